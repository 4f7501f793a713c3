#include "daemon/api/session.h"

#include <boost/asio/post.hpp>
#include <boost/asio/write.hpp>

namespace scanrig {
namespace {

namespace net = boost::asio;
namespace http = boost::beast::http;

const scanrig::Error kTooMany{ErrorCode::busy, "there are too many connections: try again later"};
const scanrig::Error kTooOften{ErrorCode::busy, "too many requests: wait a moment"};
const scanrig::Error kNoHead{ErrorCode::unsupported, "this is made when it is downloaded: use GET"};
const scanrig::Error kNoAnswer{ErrorCode::timeout, "the rig did not respond in time: see scanrig status"};
constexpr unsigned kOk = 200, kNotModified = 304, kFirstError = 400, kForbidden = 403;
constexpr std::size_t kMaxPathLength = 200;  ///< in the log
constexpr auto kDrainTime = std::chrono::seconds(1);

std::optional<ApiResponse> understand(boost::beast::error_code error) {
  if (error == http::error::header_limit) {
    return error_response(431, {ErrorCode::invalid_input, "the request's header is too large"});
  }
  if (error == http::error::body_limit) {
    return error_response(413, {ErrorCode::invalid_input, "the request's body is too large"});
  }
  if (error.category() == make_error_code(http::error::end_of_stream).category() &&
      error != http::error::end_of_stream && error != http::error::partial_message) {
    return error_response(400, {ErrorCode::invalid_input, "this is not an HTTP request"});
  }
  return std::nullopt;  // gone, or too slow
}

}  // namespace

ApiSession::~ApiSession() {
  if (subscription_) core_.hub.unsubscribe(*subscription_);
}

void ApiSession::start() {
  net::post(stream_.get_executor(), [self = shared_from_this()] {
    self->take(Place::waiting, self->core_.admission->wait(self->peer_.door, self->peer_.name, self->when_evicted()));
    self->read_header();
  });
}

void ApiSession::take(Place place, Admission::SeatPtr seat) {
  place_ = place;
  seat_ = std::move(seat);
}

/// Sender of the request just read. A connection of a proxy may carry requests of many.
bool ApiSession::take_seat(bool may_use_reserved) {
  if (place_ == Place::seat && seat_->peer() == requester_) return true;
  const auto door = peer_.is_proxy ? Admission::Door::tcp : peer_.door;
  const auto had = seat_number_;
  if (auto seat = core_.admission->enter(door, requester_, when_evicted())) {
    take(Place::seat, std::move(seat));
    return true;
  }
  seat_number_ = had;  // its present place may still be taken away
  if (!may_use_reserved) return false;
  last_ = true;
  take(Place::reserved, core_.admission->enter_reserved(requester_, when_evicted()));
  return true;
}

/// A seat exchanged for another is no reason to hang up when it is taken away late.
Admission::OnEvicted ApiSession::when_evicted() {
  return [weak = weak_from_this(), strand = stream_.get_executor(), number = ++seat_number_] {
    net::post(strand, [weak, number] {
      if (const auto self = weak.lock()) self->evicted(number);
    });
  };
}

void ApiSession::evicted(std::uint64_t number) {
  if (number != seat_number_) return;
  timer_.cancel();
  hang_up();
}

void ApiSession::read_header() {
  parser_.emplace();
  parser_->header_limit(core_.limits.header_bytes);
  parser_->body_limit(core_.limits.body_bytes);
  stream_.expires_after(core_.limits.header_time);
  http::async_read_header(stream_, buffer_, *parser_,
                          [self = shared_from_this()](Error error, std::size_t) { self->on_header(error); });
}

void ApiSession::on_header(Error error) {
  if (error) {
    auto complaint = understand(error);
    if (!complaint) return hang_up();
    last_ = true;
    return write_text(std::move(*complaint));
  }
  ++core_.requests;
  last_ = !parser_->get().keep_alive();
  is_head_ = parser_->get().method() == http::verb::head;
  requester_ = requester();
  identity_ = identify();
  if (auto stranger = refuse_stranger()) return refuse(std::move(*stranger), true);
  auto found = core_.router.find(method(), plain(parser_->get().target()), identity_.role);
  const bool may = may_request(found ? found->route : nullptr, identity_.role.has_value());
  if (!may) return refuse(error_response(429, kTooOften), false);
  if (!found && !identity_.role) return refuse(std::move(found.error()), true);
  // The page itself, and logging in, are served from a waiting place.
  if (identity_.role && !take_seat(found && found->route->reserved)) return refuse(error_response(503, kTooMany), true);
  if (!found) {
    const auto order = found.error().status == kForbidden ? order_of() : std::nullopt;
    if (order) tell_refused(*order, found.error().why);
    return refuse(std::move(found.error()), false);
  }
  once_ = found->route->once;
  if (is_head_ && once_) return refuse(error_response(405, kNoHead), false);
  match_ = std::move(*found);
  match_->values.set_requester(seat_->peer(), identity_);
  order_ = order_of();
  const auto job = order_ ? find_job(core_.station, match_->values) : nullptr;
  if (job) order_->job = job->id;
  if (parser_->is_done()) return call();
  stream_.expires_after(core_.limits.body_time);
  http::async_read(stream_, buffer_, *parser_,
                   [self = shared_from_this()](Error failed, std::size_t) { self->on_body(failed); });
}

/// Requests that another site's page may have caused: under a name that is not ours, or orders that a browser sends
/// with our cookie by itself. What comes over the Unix socket of this machine is no browser's.
std::optional<ApiResponse> ApiSession::refuse_stranger() const {
  const auto host = header(http::field::host), origin = header(http::field::origin);
  const bool may_be_browser = peer_.door == Admission::Door::tcp || peer_.is_proxy;
  if (may_be_browser && !core_.origins.is_own_host(host)) {
    return error_response(421,
                          {ErrorCode::refused, "not a name of the rig: use its address, or set [api] http_origin"});
  }
  if (method() == to_string(Method::get)) return std::nullopt;
  const bool by_cookie = !identity_.cookie.empty();
  const bool is_ours = core_.origins.is_own_origin(origin, host) && (!by_cookie || parser_->get()["X-Scanrig"] == "1");
  if (is_ours || (!by_cookie && (origin.empty() || !may_be_browser))) return std::nullopt;
  return error_response(403, {ErrorCode::refused, "this order did not come from the rig's own page"});
}

/// Stop and status have a separate allowance: neither bad tokens nor other requests use it up.
bool ApiSession::may_request(const Route* route, bool authenticated) {
  const auto now = Admission::Clock::now();
  if (route && route->reserved) return core_.admission->may_request(fmt::format("{} {}", route->path, requester_), now);
  if (!authenticated && !header(http::field::authorization).empty()) core_.admission->charge_bad_token(requester_, now);
  if (!identity_.cookie.empty() && route && route->method != Method::get) {
    return core_.admission->may_order(requester_, now);
  }
  return core_.admission->may_request(requester_, now);
}

/// An unread body would block the next request.
void ApiSession::refuse(ApiResponse response, bool must_close) {
  ++core_.refused;
  last_ = last_ || must_close || !parser_->is_done();
  write_text(std::move(response));
}

void ApiSession::on_body(Error error) {
  if (!error) return call();
  last_ = true;
  auto complaint = understand(error);
  if (!complaint) return hang_up();
  write_text(std::move(*complaint));
}

/// The reply may come from a worker or from the control loop; until then only the timer keeps this session.
void ApiSession::call() {
  await_answer(match_->route->reply_timeout);
  const bool slow = match_->route->slow;
  auto work = [match = std::move(*match_), body = parser_->get().body(), &core = core_, send = sender()]() mutable {
    Router::call(std::move(match), body, core.station, std::move(send));
  };
  match_.reset();
  if (slow) {
    net::post(core_.workers, std::move(work));
  } else {
    work();
  }
}

std::optional<ApiSession::JobOrder> ApiSession::order_of() const {
  const auto how = method();
  if (how == to_string(Method::get) || !identity_.role) return std::nullopt;
  const auto target = plain(parser_->get().target());
  return JobOrder{fmt::format("{} {}, requested by {} ({})", how,
                              target.substr(0, target.find('?')).substr(0, kMaxPathLength), requester_,
                              to_string(*identity_.role))};
}

void ApiSession::tell_refused(const JobOrder& order, const std::string& why) const {
  core_.journal(
      {.priority = Priority::notice, .message = fmt::format("{}, is refused: {}", order.asked, why), .job = order.job});
}

void ApiSession::await_answer(std::chrono::milliseconds reply_timeout) {
  waiting_ = true;
  timer_.expires_after(std::max(reply_timeout, core_.limits.answer_time));
  timer_.async_wait([self = shared_from_this()](Error error) {
    if (error || !self->waiting_) return;
    self->last_ = true;
    self->answer(error_response(503, kNoAnswer));
  });
}

Send ApiSession::sender() {
  return [weak = weak_from_this()](ApiResponse response) {
    const auto self = weak.lock();
    if (!self) return;
    net::post(self->stream_.get_executor(),
              [weak, response = std::move(response), on_its_way = self->core_.answers]() mutable {
                const auto session = weak.lock();
                if (!session) return;
                session->on_its_way_ = std::move(on_its_way);
                session->answer(std::move(response));
              });
  };
}

void ApiSession::answer(ApiResponse response) {
  const bool soon_written = waiting_ && std::holds_alternative<std::string>(response.body);
  if (!soon_written) on_its_way_.reset();
  if (!waiting_) return;  // it was given up
  waiting_ = false;
  timer_.cancel();
  if (order_ && response.status >= kFirstError) tell_refused(*order_, response.why);
  if (is_known(response)) {
    response.status = kNotModified;
    response.body = std::string();
  } else if (is_head_ && std::holds_alternative<EventStream>(response.body)) {
    response = {.type = "text/event-stream"};
  }
  if (std::holds_alternative<std::shared_ptr<OpenFile>>(response.body)) {
    begin_file(std::move(response));
  } else if (std::holds_alternative<EventStream>(response.body)) {
    begin_events(response);
  } else {
    write_text(std::move(response));
  }
}

/// Headers common to all replies. Content of a job's folder is shown, never run.
void ApiSession::set_head(const ApiResponse& response) {
  const auto& type = response.type;
  response_ = {static_cast<http::status>(response.status), 11};
  response_.set(http::field::content_type, {type.data(), type.size()});
  response_.set(http::field::cache_control, "no-store");
  response_.set("X-Content-Type-Options", "nosniff");
  response_.set("Content-Security-Policy", "default-src 'none'; img-src data:; style-src 'unsafe-inline'; sandbox");
  if (response.status == 401) response_.set(http::field::www_authenticate, "Bearer");
  for (const auto& [name, value] : response.headers) response_.set({name.data(), name.size()}, value);
  response_.keep_alive(!last_);
}

void ApiSession::write_text(ApiResponse response) {
  set_head(response);
  response_.body() = std::move(std::get<std::string>(response.body));
  response_.prepare_payload();
  if (is_head_) response_.body().clear();  // its length stays in the head
  stream_.expires_after(core_.limits.answer_time);
  http::async_write(stream_, response_,
                    [self = shared_from_this()](Error error, std::size_t) { self->on_written(error); });
}

void ApiSession::on_written(Error error) {
  on_its_way_.reset();
  if (error) return hang_up();
  if (last_) return drain();
  read_header();
}

void ApiSession::hang_up() { stream_.close(); }

/// A socket closed while the client still sends would lose the reply.
void ApiSession::drain() {
  Error ignored;
  stream_.socket().shutdown(net::socket_base::shutdown_send, ignored);
  chunk_.resize(4096);
  stream_.expires_after(kDrainTime);
  drain_more();
}

void ApiSession::drain_more() {
  stream_.async_read_some(net::buffer(chunk_), [self = shared_from_this()](Error error, std::size_t) {
    if (error) return self->hang_up();
    self->drain_more();
  });
}

/// HEAD is routed as GET.
std::string_view ApiSession::method() const {
  return is_head_ ? to_string(Method::get) : plain(parser_->get().method_string());
}

/// The client has this content already: its ETag is in If-None-Match.
bool ApiSession::is_known(const ApiResponse& response) const {
  const auto known = header(http::field::if_none_match);
  if (known.empty() || response.status != kOk || once_) return false;
  if (const auto* file = std::get_if<std::shared_ptr<OpenFile>>(&response.body)) return known == (*file)->tag();
  return std::ranges::any_of(response.headers,
                             [&](const auto& one) { return one.first == "ETag" && one.second == known; });
}

std::string_view ApiSession::header(http::field name) const { return plain(parser_->get()[name]); }

Identity ApiSession::identify() const {
  const auto cookie = cookie_value(header(http::field::cookie), login_cookie(core_.station.tls));
  return core_.access.identify(peer_.role, header(http::field::authorization), cookie,
                               std::chrono::system_clock::now());
}

/// Several lines of one header form one list.
std::string ApiSession::requester() const {
  if (!peer_.is_proxy) return peer_.name;
  const auto lines = parser_->get().equal_range("X-Forwarded-For");
  if (lines.first == lines.second) return peer_.name;
  return forwarded_address(plain(std::prev(lines.second)->value())).value_or(peer_.name);
}

}  // namespace scanrig
