#include "sim/wire/gige_sensor.h"

#include <algorithm>
#include <opencv2/core.hpp>

#include "sim/wire/gige_develop.h"

namespace scanrig::sim::wire {
namespace {

constexpr std::uint16_t kIdBeforeFirst = 65000;  // the ids wrap soon

/// Mean over 5x5 pixels, fewer at the rim.
void blur(cv::Mat& image) {
  constexpr int kReach = 2;
  const cv::Mat sharp = image.clone();
  const cv::Rect whole(0, 0, image.cols, image.rows);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      const cv::Rect around(x - kReach, y - kReach, 2 * kReach + 1, 2 * kReach + 1);
      image.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(cv::mean(sharp(around & whole))[0]);
    }
  }
}

std::uint16_t id_after(std::uint16_t id) { return id == 65535 ? 1 : static_cast<std::uint16_t>(id + 1); }

std::chrono::nanoseconds microseconds(double us) {
  return std::chrono::round<std::chrono::nanoseconds>(std::chrono::duration<double, std::micro>(us));
}

}  // namespace

Result<std::unique_ptr<GigeSensor>> GigeSensor::start(const GigeSensorOptions& options, FrameSource source,
                                                      Clock& clock) {
  std::unique_ptr<GigeSensor> sensor(new GigeSensor(options, std::move(source), clock));
  if (auto plugged = sensor->plug(true); !plugged) return pass_on(plugged);
  return sensor;
}

GigeSensor::GigeSensor(const GigeSensorOptions& options, FrameSource source, Clock& clock)
    : options_(options),
      source_(std::move(source)),
      clock_(clock),
      started_(clock.now()),
      registers_(options.model, clock),
      sender_([this](const std::stop_token& stop) { send_frames(stop); }) {}

GigeSensor::~GigeSensor() {
  sender_.request_stop();
  changed_.notify_all();
  sender_.join();
  std::ignore = plug(false);
}

Result<void> GigeSensor::plug(bool in) {
  if (!in) {
    std::unique_lock lock(mutex_);
    std::shared_ptr<GigeWire> wire = std::exchange(wire_, nullptr);
    queue_.clear();
    lock.unlock();
    // The address is free only when the frame that is being sent has ended.
    while (wire && wire.use_count() > 1) clock_.sleep_for(std::chrono::milliseconds(1));
    return {};
  }
  GigeWireOptions options;
  options.address = options_.address;
  options.serial = options_.serial;
  options.description = describe(registers_.features());
  if (options_.model.state) {
    std::mt19937_64 random(*options_.model.state);
    options.packet_bytes = 576 + static_cast<std::uint32_t>(random() % 900);
    options.packet_delay_ns = static_cast<std::uint32_t>(random() % 50'000);
  }
  GigeWire::Handlers handlers;
  handlers.read = [this](std::uint32_t address) {
    const std::scoped_lock lock(mutex_);
    return registers_.read(address);
  };
  handlers.write = [this](std::uint32_t address, std::uint32_t value) { return write(address, value); };
  handlers.is_acquiring = [this] {
    const std::scoped_lock lock(mutex_);
    return registers_.is_acquiring();
  };
  handlers.on_abandoned = [this] { stop_acquiring(); };
  {
    const std::scoped_lock lock(mutex_);
    registers_.power_on();
  }
  auto wire = GigeWire::open(options, std::move(handlers), clock_);
  if (!wire) return pass_on(wire);
  const std::scoped_lock lock(mutex_);
  wire_ = std::move(*wire);
  return {};
}

void GigeSensor::set_clock(std::chrono::nanoseconds by) {
  const std::scoped_lock lock(mutex_);
  set_by_ += by;
}

GvcpStatus GigeSensor::write(std::uint32_t address, std::uint32_t value) {
  std::unique_lock lock(mutex_);
  const auto written = registers_.write(address, value);
  if (written.status != GvcpStatus::success) return written.status;
  if (written.event == GigeRegisters::Event::acquisition_started) {
    last_id_ = kIdBeforeFirst;
    last_.reset();
    next_free_ = clock_.now();
  }
  if (written.event == GigeRegisters::Event::acquisition_stopped) queue_.clear();
  const bool triggers = written.event == GigeRegisters::Event::software_trigger && waits_for("Software");
  clock_.notify_all(changed_);
  lock.unlock();
  if (triggers) expose_by_software();
  return GvcpStatus::success;
}

void GigeSensor::stop_acquiring() {
  const std::scoped_lock lock(mutex_);
  registers_.stop_acquiring();
  queue_.clear();
  clock_.notify_all(changed_);
}

/// Call with `mutex_` held, as the next four.
bool GigeSensor::streaming() const { return wire_ && registers_.is_acquiring() && wire_->is_open(); }

/// The frame's own trigger is the last that TriggerSelector has.
std::size_t GigeSensor::frame_trigger() const {
  const auto& features = registers_.features();
  const auto selector = std::ranges::find(features, "TriggerSelector", &GigeFeature::name);
  return selector == features.end() ? 0 : selector->entries.size() - 1;
}

/// True if nothing but this source is missing for an exposure: every trigger that is on has to come.
bool GigeSensor::waits_for(const std::string& source) const {
  if (!streaming()) return false;
  const std::size_t own = frame_trigger();
  for (std::size_t i = 0; i < own; ++i) {
    if (registers_.number("TriggerMode", i) != 0) return false;
  }
  return registers_.number("TriggerMode", own) != 0 && registers_.entry("TriggerSource", own) == source;
}

bool GigeSensor::runs_freely() const {
  if (!streaming()) return false;
  for (std::size_t i = 0; i <= frame_trigger(); ++i) {
    if (registers_.number("TriggerMode", i) != 0) return false;
  }
  return true;
}

std::optional<int> GigeSensor::active_output() const {
  for (const int line : {1, 2}) {
    const auto selected = static_cast<std::size_t>(line);
    if (registers_.entry("LineMode", selected) == "Output" &&
        registers_.entry("LineSource", selected) == "ExposureActive") {
      return line;
    }
  }
  return std::nullopt;
}

GigeSensor::Frame GigeSensor::new_frame(const GigeExposure& exposure) {
  last_id_ = id_after(last_id_);
  constexpr auto kBegin = std::chrono::hours(10);
  std::chrono::nanoseconds stamp = kBegin + exposure.at.time_since_epoch();  // of the clock that PTP follows
  if (!registers_.is_synchronised()) {
    const auto since = exposure.at - started_;
    const auto drift = static_cast<std::int64_t>(static_cast<double>(since.count()) * options_.clock_drift);
    stamp = kBegin + options_.clock_ahead + set_by_ + since + std::chrono::nanoseconds(drift);
  }
  Frame frame;
  frame.id = last_id_;
  frame.stamp = stamp;
  frame.exposure = exposure;
  frame.due = exposure.at;
  return frame;
}

void GigeSensor::expose(const GigeExposure& exposure, GigeFault fault) {
  const std::scoped_lock lock(mutex_);
  if (fault == GigeFault::missed || !waits_for("Line0")) return;
  const std::size_t own = frame_trigger();
  const bool overlaps = registers_.entry("TriggerOverlap", own) == "ReadOut";
  if (!overlaps && exposure.at < busy_until_) return;  // still reading out
  GigeExposure delayed = exposure;
  delayed.at += microseconds(registers_.number("TriggerDelay", own));
  Frame frame = new_frame(delayed);
  frame.fault = fault;
  frame.is_by_edge = true;
  frame.due += options_.frame_after;
  busy_until_ = frame.due;
  if (fault == GigeFault::late) frame.due += options_.late_by;
  if (fault == GigeFault::stale && last_) {
    const auto id = frame.id;  // ids are given when sent
    const auto due = frame.due;
    frame = *last_;
    frame.id = id;
    frame.due = due;
  } else {
    last_ = frame;
    last_->fault = GigeFault::none;
  }
  if (fault == GigeFault::lost) return;
  queue_.push_back(frame);
  if (registers_.entry("TriggerActivation", own) == "LevelHigh") {  // the level lasts longer than a frame
    Frame again = new_frame(delayed);
    again.due = frame.due;
    queue_.push_back(again);
  }
  clock_.notify_all(changed_);
}

void GigeSensor::expose_by_software() {
  std::unique_lock lock(mutex_);
  const auto active = active_output();
  Strobe strobe{{kFirstBySoftware + ++by_software_, false, clock_.now()}};
  const auto show = on_strobe_;
  lock.unlock();
  if (active && show) strobe = show(*active);  // without the lock: it takes the other camera's
  lock.lock();
  strobe.exposure.at += microseconds(registers_.number("TriggerDelay", frame_trigger()));
  Frame frame = new_frame(strobe.exposure);
  frame.fault = strobe.fault;
  last_ = frame;
  last_->fault = GigeFault::none;
  queue_.push_back(frame);
  clock_.notify_all(changed_);
}

/// Call with `mutex_` held. Queues the next frame of a camera whose triggers are off.
void GigeSensor::run_freely() {
  const auto now = clock_.now();
  if (now < next_free_ || !queue_.empty()) return;
  const double rate =
      registers_.number("AcquisitionFrameRateEnable") != 0 ? registers_.number("AcquisitionFrameRate") : 20.0;
  next_free_ = now + microseconds(1e6 / std::max(rate, 1.0));
  queue_.push_back(new_frame({kFirstBySoftware + ++by_software_, false, now}));
}

/// Sends one frame after the other, each when it is due and its image is ready.
void GigeSensor::send_frames(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (!stop.stop_requested()) {
    if (!streaming()) queue_.clear();  // a camera that is not acquiring drops its edges
    if (runs_freely()) run_freely();
    const auto now = clock_.now();
    const auto first = std::ranges::min_element(queue_, {}, &Frame::due);
    bool developing = false;
    if (first != queue_.end() && first->due <= now) {
      const Frame frame = *first;
      developing = frame.is_by_edge && options_.ready && !options_.ready(frame.exposure);
      if (!developing) {
        queue_.erase(first);
        lock.unlock();
        send(frame, stop);
        lock.lock();
        continue;
      }
    }
    auto wake = now + std::chrono::milliseconds(developing ? 2 : 100);
    for (const Frame& frame : queue_) {
      if (frame.due > now) wake = std::min(wake, frame.due);
    }
    if (runs_freely()) wake = std::min(wake, std::max(next_free_, now));
    const std::size_t waiting = queue_.size();
    const bool acquiring = registers_.is_acquiring();
    clock_.wait_until(lock, changed_, wake, [&] {
      return stop.stop_requested() || queue_.size() != waiting || registers_.is_acquiring() != acquiring;
    });
  }
}

void GigeSensor::send(const Frame& frame, const std::stop_token& stop) {
  cv::Mat image(options_.model.sensor, CV_8U);
  draw(frame, image);
  std::unique_lock lock(mutex_);
  if (!streaming()) return;
  const GigeRegisters registers = registers_;
  const std::shared_ptr<GigeWire> wire = wire_;
  if (registers.entry("AcquisitionMode") == "SingleFrame") registers_.stop_acquiring();
  adjust_gige(registers_, cv::mean(image)[0]);
  lock.unlock();
  GigeBlock block;
  block.id = frame.id;
  block.stamp_ns = static_cast<std::uint64_t>(frame.stamp.count());
  block.pixel_format = static_cast<std::uint32_t>(registers.number("PixelFormat"));
  block.region = {{static_cast<int>(registers.number("OffsetX")), static_cast<int>(registers.number("OffsetY"))},
                  registers.frame_size()};
  block.has_chunks = registers.number("ChunkModeActive") != 0;
  block.bytes = develop_gige(image, registers, static_cast<double>(options_.nominal_exposure.count()), block.stamp_ns);
  constexpr double kTornShare = 0.5;
  wire->send(block, frame.fault == GigeFault::torn ? kTornShare : 0.0, stop);
}

void GigeSensor::on_strobe(std::function<Strobe(int output)> act) {
  const std::scoped_lock lock(mutex_);
  on_strobe_ = std::move(act);
}

std::optional<int> GigeSensor::output() const {
  const std::scoped_lock lock(mutex_);
  return wire_ ? active_output() : std::nullopt;
}

std::chrono::microseconds GigeSensor::exposure_time() const {
  const std::scoped_lock lock(mutex_);
  return std::chrono::round<std::chrono::microseconds>(microseconds(registers_.number("ExposureTime")));
}

std::string GigeSensor::value(const std::string& feature) const {
  const std::scoped_lock lock(mutex_);
  const std::size_t selected = feature.starts_with("Trigger") ? frame_trigger() : 0;
  const std::string entry = registers_.entry(feature, selected);
  return entry.empty() ? fmt::format("{}", registers_.number(feature, selected)) : entry;
}

void GigeSensor::draw(const Frame& frame, cv::Mat& image) const {
  Side side = options_.side;
  if (frame.fault == GigeFault::swapped) side = side == Side::left ? Side::right : Side::left;
  source_(side, frame.exposure, image);
  if (frame.fault == GigeFault::dark) image.setTo(3);
  if (frame.fault == GigeFault::blurred) {
    for (int pass = 0; pass < 2; ++pass) blur(image);
  }
  if (options_.numbered) hide_number(static_cast<std::uint32_t>(frame.exposure.number), image);
}

}  // namespace scanrig::sim::wire
