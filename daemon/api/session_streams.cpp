#include <unistd.h>

#include <boost/asio/post.hpp>
#include <boost/asio/write.hpp>
#include <sstream>

#include "core/timestamp.h"
#include "daemon/api/downloads.h"
#include "daemon/api/session.h"

namespace scanrig {
namespace {

namespace http = boost::beast::http;
namespace net = boost::asio;

constexpr std::size_t kChunk = 64 * 1024;
constexpr unsigned kPartial = 206, kNotSatisfiable = 416;

}  // namespace

// Files and events, which a session sends piece by piece.

std::string ApiSession::head_text() const {
  std::ostringstream text;
  text << response_.base();
  return text.str();
}

/// One limit for the whole part, long enough for the slowest client that is served.
void ApiSession::begin_file(ApiResponse response) {
  file_ = std::get<std::shared_ptr<OpenFile>>(response.body);
  const auto if_range = header(http::field::if_range);
  const bool may_be_part = !once_ && (if_range.empty() || if_range == file_->tag());
  const auto part = part_of_file(may_be_part ? header(http::field::range) : "", file_->size());
  if (!part) {
    auto refused = error_response(kNotSatisfiable, {ErrorCode::out_of_range, "the file ends before this part of it"});
    refused.headers.emplace_back("Content-Range", fmt::format("bytes */{}", file_->size()));
    file_.reset();
    return write_text(std::move(refused));
  }
  if (*part != FilePart{0, file_->size()}) {
    response.status = kPartial;
    response.headers.emplace_back("Content-Range",
                                  fmt::format("bytes {}-{}/{}", part->begin, part->end - 1, file_->size()));
  }
  if (!once_) {
    response.headers.emplace_back("ETag", file_->tag());
    response.headers.emplace_back("Accept-Ranges", "bytes");
  }
  set_head(response);
  response_.content_length(part->end - part->begin);
  end_ = part->end;
  sent_ = is_head_ ? end_ : part->begin;
  chunk_ = head_text();
  const std::chrono::duration<double> download(static_cast<double>(end_ - sent_) / core_.limits.slowest_bytes_a_second);
  stream_.expires_after(core_.limits.answer_time + std::chrono::ceil<std::chrono::milliseconds>(download));
  write_chunk();
}

void ApiSession::write_chunk() {
  net::async_write(stream_, net::buffer(chunk_), [self = shared_from_this()](Error error, std::size_t) {
    if (error) return self->hang_up();
    if (self->sent_ < self->end_) return self->read_chunk();
    self->file_.reset();
    self->on_written({});
  });
}

/// Runs on a worker: a slow disk delays only this connection.
void ApiSession::read_chunk() {
  net::post(core_.workers, [self = shared_from_this()] {
    self->chunk_.resize(std::min<std::uint64_t>(kChunk, self->end_ - self->sent_));
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

void ApiSession::begin_events(const ApiResponse& response) {
  const auto& wanted = std::get<EventStream>(response.body);
  last_ = true;
  beats_ = wanted.beats;
  subscription_ = core_.hub.subscribe([weak = weak_from_this(), strand = stream_.get_executor()] {
    net::post(strand, [weak] {
      if (const auto self = weak.lock()) self->events_due();
    });
  });
  set_head({.type = "text/event-stream"});
  const auto last_event_id = plain(parser_->get()["Last-Event-ID"]);
  auto batch = core_.hub.join(last_event_id.empty() ? wanted.after : last_event_id);
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
  timer_.expires_after(beats_ ? core_.limits.beat : core_.limits.heartbeat);
  timer_.async_wait([self = shared_from_this()](Error error) {
    if (!error) self->beat();
  });
}

/// Sends a heartbeat; a client without the right to listen any more is cut off then.
void ApiSession::beat() {
  if (writing_events_) return;
  if (!identify().role) return hang_up();
  static const auto kComment = std::make_shared<const std::string>(":\n\n");
  send_events({last_event_, {beats_ ? core_.hub.beat(iso_time(std::chrono::system_clock::now())) : kComment}});
}

}  // namespace scanrig
