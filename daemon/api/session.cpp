#include "daemon/api/session.h"

#include <unistd.h>

#include <boost/asio/post.hpp>
#include <boost/asio/write.hpp>
#include <sstream>

namespace scanrig {
namespace {

namespace net = boost::asio;
namespace http = boost::beast::http;

const scanrig::Error kTooMany{ErrorCode::busy, "there are too many connections: try again later"};
const scanrig::Error kTooOften{ErrorCode::busy, "too many requests: wait a moment"};
const scanrig::Error kNoAnswer{ErrorCode::timeout, "the rig did not respond in time: see scanrig status"};
constexpr unsigned kFirstError = 400, kForbidden = 403;
constexpr std::size_t kMaxPathLength = 200;  ///< in the log
constexpr auto kDrainTime = std::chrono::seconds(1);

std::string_view plain(boost::beast::string_view text) { return {text.data(), text.size()}; }

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

constexpr std::size_t kChunk = 64 * 1024;

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
  const auto as = role();
  requester_ = requester();
  auto found = core_.router.find(plain(parser_->get().method_string()), plain(parser_->get().target()), as);
  const bool may = may_request(found ? found->route : nullptr, as.has_value());
  if (!may) return refuse(error_response(429, kTooOften), false);
  if (!as) return refuse(std::move(found.error()), true);
  if (!take_seat(found && found->route->reserved)) return refuse(error_response(503, kTooMany), true);
  if (!found) {
    const auto order = found.error().status == kForbidden ? order_of(*as) : std::nullopt;
    if (order) tell_refused(*order, found.error().why);
    return refuse(std::move(found.error()), false);
  }
  match_ = std::move(*found);
  match_->values.set_requester(seat_->peer());
  order_ = order_of(*as);
  const auto job = order_ ? find_job(core_.station, match_->values) : nullptr;
  if (job) order_->job = job->id;
  if (parser_->is_done()) return call();
  stream_.expires_after(core_.limits.body_time);
  http::async_read(stream_, buffer_, *parser_,
                   [self = shared_from_this()](Error failed, std::size_t) { self->on_body(failed); });
}

/// Stop and status have a separate allowance: neither bad tokens nor other requests use it up.
bool ApiSession::may_request(const Route* route, bool authenticated) {
  const auto now = Admission::Clock::now();
  if (route && route->reserved) return core_.admission->may_request(fmt::format("{} {}", route->path, requester_), now);
  if (!authenticated && !header(http::field::authorization).empty()) core_.admission->charge_bad_token(requester_, now);
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

std::optional<ApiSession::JobOrder> ApiSession::order_of(Role as) const {
  const auto method = plain(parser_->get().method_string());
  if (method == to_string(Method::get)) return std::nullopt;
  const auto target = plain(parser_->get().target());
  return JobOrder{fmt::format("{} {}, requested by {} ({})", method,
                              target.substr(0, target.find('?')).substr(0, kMaxPathLength), requester_, to_string(as))};
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
  if (const auto* file = std::get_if<std::shared_ptr<OpenFile>>(&response.body)) {
    begin_file(*file, response.type);
  } else if (std::holds_alternative<EventStream>(response.body)) {
    begin_events();
  } else {
    write_text(std::move(response));
  }
}

/// Headers common to all replies. Content of a job's folder is shown, never run.
void ApiSession::set_head(unsigned status, std::string_view type) {
  response_ = {static_cast<http::status>(status), 11};
  response_.set(http::field::content_type, {type.data(), type.size()});
  response_.set(http::field::cache_control, "no-store");
  response_.set("X-Content-Type-Options", "nosniff");
  response_.set("Content-Security-Policy", "default-src 'none'; img-src data:; style-src 'unsafe-inline'; sandbox");
  if (status == 401) response_.set(http::field::www_authenticate, "Bearer");
  response_.keep_alive(!last_);
}

void ApiSession::write_text(ApiResponse response) {
  set_head(response.status, response.type);
  response_.body() = std::move(std::get<std::string>(response.body));
  response_.prepare_payload();
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

std::string_view ApiSession::header(http::field name) const { return plain(parser_->get()[name]); }

std::optional<Role> ApiSession::role() const {
  return core_.access.role_of(peer_.role, header(http::field::authorization));
}

/// Several lines of one header form one list.
std::string ApiSession::requester() const {
  if (!peer_.is_proxy) return peer_.name;
  const auto lines = parser_->get().equal_range("X-Forwarded-For");
  if (lines.first == lines.second) return peer_.name;
  return forwarded_address(plain(std::prev(lines.second)->value())).value_or(peer_.name);
}

// Files and events, which a session sends piece by piece.

std::string ApiSession::head_text() const {
  std::ostringstream text;
  text << response_.base();
  return text.str();
}

/// One limit for the whole file, long enough for the slowest client that is served.
void ApiSession::begin_file(std::shared_ptr<OpenFile> file, std::string_view type) {
  file_ = std::move(file);
  sent_ = 0;
  set_head(200, type);
  response_.content_length(file_->size());
  chunk_ = head_text();
  const std::chrono::duration<double> download(static_cast<double>(file_->size()) /
                                               core_.limits.slowest_bytes_a_second);
  stream_.expires_after(core_.limits.answer_time + std::chrono::ceil<std::chrono::milliseconds>(download));
  write_chunk();
}

void ApiSession::write_chunk() {
  net::async_write(stream_, net::buffer(chunk_), [self = shared_from_this()](Error error, std::size_t) {
    if (error) return self->hang_up();
    if (self->sent_ < self->file_->size()) return self->read_chunk();
    self->file_.reset();
    self->on_written({});
  });
}

/// Runs on a worker: a slow disk delays only this connection.
void ApiSession::read_chunk() {
  net::post(core_.workers, [self = shared_from_this()] {
    self->chunk_.resize(std::min<std::uint64_t>(kChunk, self->file_->size() - self->sent_));
    const auto got =
        ::pread(self->file_->fd(), self->chunk_.data(), self->chunk_.size(), static_cast<off_t>(self->sent_));
    net::post(self->stream_.get_executor(), [self, got] {
      if (got <= 0) return self->hang_up();  // the file became shorter: better no reply than a wrong one
      self->chunk_.resize(static_cast<std::size_t>(got));
      self->sent_ += static_cast<std::uint64_t>(got);
      self->write_chunk();
    });
  });
}

void ApiSession::begin_events() {
  last_ = true;
  subscription_ = core_.hub.subscribe([weak = weak_from_this(), strand = stream_.get_executor()] {
    net::post(strand, [weak] {
      if (const auto self = weak.lock()) self->events_due();
    });
  });
  set_head(200, "text/event-stream");
  const auto last_event_id = parser_->get().find("Last-Event-ID");
  auto batch = core_.hub.join(last_event_id == parser_->get().end() ? "" : std::string(last_event_id->value()));
  batch.texts.insert(batch.texts.begin(), std::make_shared<const std::string>(head_text()));
  send_events(std::move(batch));
}

void ApiSession::events_due() {
  if (!writing_events_) send_events(core_.hub.after(last_event_));
}

void ApiSession::send_events(EventHub::Batch batch) {
  last_event_ = batch.last;
  batch_ = std::move(batch.texts);
  if (batch_.empty()) return wait_for_events();
  std::vector<net::const_buffer> buffers;
  for (const auto& text : batch_) buffers.push_back(net::buffer(*text));
  writing_events_ = true;
  stream_.expires_after(core_.limits.answer_time);
  net::async_write(stream_, buffers, [self = shared_from_this()](Error error, std::size_t) {
    self->writing_events_ = false;
    if (error) return self->hang_up();
    self->events_due();
  });
}

void ApiSession::wait_for_events() {
  timer_.expires_after(core_.limits.heartbeat);
  timer_.async_wait([self = shared_from_this()](Error error) {
    if (!error) self->beat();
  });
}

/// Sends a heartbeat; a client without the right to listen any more is cut off then.
void ApiSession::beat() {
  if (writing_events_) return;
  if (!role()) return hang_up();
  send_events({last_event_, {std::make_shared<const std::string>(":\n\n")}});
}

}  // namespace scanrig
