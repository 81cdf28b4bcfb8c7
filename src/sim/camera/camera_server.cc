#include "sim/camera/camera_server.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

#include "base/bug_note.h"
#include "base/check.h"
#include "base/thread_priority.h"
#include "sim/camera/jpeg.h"

namespace trammel::sim {

namespace {

void Apply(const CameraFault& fault, ActiveFaults& active) {
  switch (fault.kind) {
    case CameraFaultKind::kStall:
      active.stall = true;
      break;
    case CameraFaultKind::kDropFrames:
      active.drop_fraction = std::max(active.drop_fraction, fault.fraction);
      break;
    case CameraFaultKind::kTimeJump:
      active.jump_s += fault.jump_s;
      break;
    case CameraFaultKind::kSizeChange:
      active.size = fault;
      break;
    case CameraFaultKind::kHalfJpeg:
      active.half_jpeg = true;
      break;
    case CameraFaultKind::kClose:
      active.close = true;
      break;
    case CameraFaultKind::kBlack:
      active.black = true;
      break;
    case CameraFaultKind::kLaserAbsent:
      active.laser_absent = true;
      break;
  }
}

}  // namespace

void CameraFaults::Add(const CameraFault& fault) {
  TRAMMEL_CHECK(fault.duration_s >= 0 && fault.fraction >= 0 && fault.fraction <= 1 &&
                    fault.width_px >= 16 && fault.width_px <= 1920 && fault.height_px >= 16 &&
                    fault.height_px <= 1080,
                "duration = {} s, fraction = {}, size = {} x {} px", fault.duration_s,
                fault.fraction, fault.width_px, fault.height_px);
  entries_.push_back({fault, {}});
}

ActiveFaults CameraFaults::At(std::int64_t frame, double time_s) {
  ActiveFaults active;
  for (Entry& entry : entries_) {
    const CameraFault& fault = entry.fault;
    const bool first = !entry.begun_s;
    if (first) {
      if (fault.at_frame ? frame < *fault.at_frame : time_s < fault.at_s) continue;
      entry.begun_s = fault.at_frame ? time_s : fault.at_s;
    }
    if (first || time_s < *entry.begun_s + fault.duration_s) Apply(fault, active);
  }
  return active;
}

Result<void> CameraTruthLog::WriteTo(const std::filesystem::path& path) {
  const std::lock_guard lock(mutex_);
  file_.reset(std::fopen(path.c_str(), "wxe"));
  if (file_) return {};
  return Fail(
      fmt::format("{}: the camera's truth cannot be written there: {}; choose a new file in "
                  "a folder that is there",
                  path.string(), std::strerror(errno)));
}

void CameraTruthLog::Add(const CameraTruth& truth) {
  const std::lock_guard lock(mutex_);
  rows_.push_back(truth);
  if (rows_.size() > kMaxRows) rows_.pop_front();
  if (!file_) return;
  const std::string row = fmt::format(
      "{{\"frame\": {}, \"capture_s\": {:.6f}, \"stamp_s\": {:.6f}, \"sent_s\": {:.6f}, "
      "\"x_mm\": {:.5f}, \"y_mm\": {:.5f}, \"z_mm\": {:.5f}, \"laser_x_mm\": {:.5f}, "
      "\"laser_y_mm\": {:.5f}, \"laser_on\": {}, \"lights_on\": {}, \"black\": {}, "
      "\"laser_hidden\": {}, \"half\": {}}}\n",
      truth.frame, truth.capture_s, truth.stamp_s, truth.sent_s, truth.machine.x_mm,
      truth.machine.y_mm, truth.machine.z_mm, truth.spot.x_mm, truth.spot.y_mm,
      truth.machine.laser_on, truth.machine.lights_on, truth.shown_black, truth.laser_hidden,
      truth.half);
  std::fwrite(row.data(), 1, row.size(), file_.get());
  std::fflush(file_.get());
}

std::vector<CameraTruth> CameraTruthLog::rows() const {
  const std::lock_guard lock(mutex_);
  return {rows_.begin(), rows_.end()};
}

namespace {

constexpr double kMaxBehindS = 0.3;  // drawing may fall behind by this before frames are lost
constexpr std::size_t kStillFrames = 8;
constexpr double kStampStepS = 1e-3;  // ustreamer cuts its stamps to whole multiples

// Frames that differ by noise only, used while nothing happens: drawing more would waste processor
// time.
class StillFrames {
 public:
  using Jpeg = std::shared_ptr<const std::vector<std::uint8_t>>;

  /// Returns a stored frame other than the one before, once there are enough.
  [[nodiscard]] Jpeg Take(const CameraMoment& moment, Random& random) {
    if (!last_ || !LookAlike(*last_, moment)) {
      last_ = moment;
      frames_.clear();
    }
    if (frames_.size() < kStillFrames) return nullptr;
    shown_ = (shown_ + 1 + random.Below(kStillFrames - 1)) % kStillFrames;
    return frames_[shown_];
  }
  void Keep(const Jpeg& jpeg) {
    if (frames_.size() < kStillFrames) frames_.push_back(jpeg);
    shown_ = frames_.size() - 1;
  }
  void Forget() { last_.reset(); }

 private:
  std::optional<CameraMoment> last_;
  std::vector<Jpeg> frames_;
  std::size_t shown_ = 0;
};

// Centres the frame in a larger or smaller one.
Frame Resized(const Frame& frame, int width, int height) {
  Frame out(width, height);
  const int columns = std::min(width, frame.width);
  const int rows = std::min(height, frame.height);
  for (int row = 0; row < rows; ++row) {
    const std::uint8_t* from = frame.view().row(row + (frame.height - rows) / 2) +
                               std::ptrdiff_t{3} * ((frame.width - columns) / 2);
    std::memcpy(out.row(row + (height - rows) / 2) + std::ptrdiff_t{3} * ((width - columns) / 2),
                from, static_cast<std::size_t>(columns) * 3);
  }
  return out;
}

class Running final : public CameraServer {
 public:
  Running(const CameraServerOptions& options, std::shared_ptr<const MachineSource> machine,
          const Random& optics)
      : options_(options),
        machine_(std::move(machine)),
        view_(DrawHeadOptics(options.condition, optics), options.view, optics.Fork(1)),
        random_(optics.Fork(2)),
        started_s_(MonotonicNow()) {
    for (const CameraFault& fault : options.faults) faults_.Add(fault);
  }
  ~Running() override {
    {
      const std::lock_guard lock(mutex_);
      stopping_ = true;
    }
    changed_.notify_all();
    if (thread_.joinable()) thread_.join();
    http_.reset();  // its thread calls Sent()
  }

  Result<void> Start() {
    if (!options_.truth_file.empty()) {
      TRY(log_.WriteTo(options_.truth_file));
    }
    http_ = TRY(CameraHttp::Listen(
        options_.port, options_.headers,
        [this](const CameraPart& part, double sent_s) { Sent(part.frame, sent_s); }));
    thread_ = std::thread([this] { (void)NoteBug([this] { Run(); }); });
    return {};
  }

  int port() const override { return http_->port(); }
  void Inject(const CameraFault& fault) override {
    const std::lock_guard lock(mutex_);
    CameraFault later = fault;
    later.at_s += MonotonicNow() - started_s_;
    faults_.Add(later);
  }
  std::vector<CameraTruth> truth() const override { return log_.rows(); }
  const HeadOptics& optics() const override { return view_.optics(); }

 private:
  void Run() {
    RaiseThisThread(ThreadUrgency::kWorking);  // a camera has a processor of its own
    const double jitter_s = view_.optics().dark.frame_jitter_s / options_.machine_time_scale;
    const double half_s = view_.exposure_s() / 2 / options_.machine_time_scale;
    const double max_s = 0.4 / options_.frames_per_s;
    for (std::int64_t frame = 0;; ++frame) {
      const double capture_s = started_s_ + static_cast<double>(frame + 1) / options_.frames_per_s +
                               std::clamp(random_.Normal(0, jitter_s), -max_s, max_s);
      if (!WaitUntil(capture_s + half_s)) return;
      (void)NoteBug([&] { Capture(frame, capture_s); });  // a failed frame is lost
    }
  }

  // Waits; false if the server must end.
  bool WaitUntil(double time_s) {
    std::unique_lock lock(mutex_);
    const std::chrono::duration<double> left(time_s - MonotonicNow());
    return !changed_.wait_for(lock, std::max(left, left.zero()), [&] { return stopping_; });
  }

  ActiveFaults FaultsAt(std::int64_t frame, double capture_s) {
    const std::lock_guard lock(mutex_);
    return faults_.At(frame, capture_s - started_s_);
  }

  void Capture(std::int64_t frame, double capture_s) {
    const ActiveFaults faults = FaultsAt(frame, capture_s);
    const double delay_s = options_.latency_s + random_.Uniform(0, 1) * options_.latency_jitter_s;
    const bool lost = random_.Uniform() < faults.drop_fraction;
    if (open_ == faults.close) {
      open_ = !faults.close;
      http_->SetOpen(open_);
    }
    if (faults.stall || lost || !open_ || !http_->wanted()) return;
    if (MonotonicNow() - capture_s > kMaxBehindS) return;
    CameraTruth truth;
    CameraPart part = Draw(capture_s, faults, truth);
    part.frame = truth.frame = frame;
    truth.capture_s = capture_s;
    part.stamp_s = std::floor(capture_s / kStampStepS) * kStampStepS + faults.jump_s;
    truth.stamp_s = part.stamp_s;
    part.half = truth.half = faults.half_jpeg;
    due_s_ = std::max({due_s_, capture_s + delay_s, MonotonicNow()});
    {
      const std::lock_guard lock(mutex_);
      unsent_.push_back(truth);
      // A frame that no client took never appears in Sent().
      while (unsent_.size() > 1000) unsent_.pop_front();
    }
    http_->Publish(std::move(part), due_s_);
  }

  CameraPart Draw(double capture_s, const ActiveFaults& faults, CameraTruth& truth) {
    CameraMoment moment = view_.MomentAt(*machine_, capture_s, options_.machine_time_scale);
    view_.Settle(moment);
    truth.machine = moment.machine;
    truth.spot = view_.LaserSpot(moment.machine);
    truth.shown_black = faults.black;
    truth.laser_hidden = faults.laser_absent;
    if (faults.laser_absent) moment.machine.laser_on = false;
    CameraPart part;
    const bool altered = faults.black || faults.size;
    if (!altered) part.jpeg = still_.Take(moment, random_);
    if (part.jpeg == nullptr) {
      if (faults.black) {
        frame_ = Frame(options_.view.frame_width_px, options_.view.frame_height_px);
      } else {
        view_.Render(moment, frame_);
      }
      if (faults.size) frame_ = Resized(frame_, faults.size->width_px, faults.size->height_px);
      auto jpeg = std::make_shared<std::vector<std::uint8_t>>();
      EncodeJpeg(frame_.view(), options_.jpeg_quality, *jpeg);
      part.jpeg = std::move(jpeg);
      if (altered) {
        still_.Forget();
      } else {
        still_.Keep(part.jpeg);
      }
    }
    part.width_px = faults.size ? faults.size->width_px : options_.view.frame_width_px;
    part.height_px = faults.size ? faults.size->height_px : options_.view.frame_height_px;
    return part;
  }

  void Sent(std::int64_t frame, double sent_s) {
    std::unique_lock lock(mutex_);
    while (!unsent_.empty() && unsent_.front().frame < frame) unsent_.pop_front();
    if (unsent_.empty() || unsent_.front().frame != frame) return;
    CameraTruth truth = unsent_.front();
    unsent_.pop_front();
    lock.unlock();
    truth.sent_s = sent_s;
    log_.Add(truth);
  }

  CameraServerOptions options_;
  std::shared_ptr<const MachineSource> machine_;
  CameraView view_;
  Random random_;
  double started_s_ = 0;
  // Used by the drawing thread only.
  StillFrames still_;
  Frame frame_;
  double due_s_ = 0;
  bool open_ = true;
  // Shared between threads.
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool stopping_ = false;
  CameraFaults faults_;
  std::deque<CameraTruth> unsent_;
  CameraTruthLog log_;
  std::unique_ptr<CameraHttp> http_;
  std::thread thread_;
};

Result<void> Within(std::string_view field, double value, double lo, double hi) {
  if (value >= lo && value <= hi) return {};
  return Fail(
      fmt::format("the virtual camera's {} is {}; it must lie in {} … {}", field, value, lo, hi));
}

}  // namespace

Result<std::unique_ptr<CameraServer>> CameraServer::Start(
    const CameraServerOptions& options, std::shared_ptr<const MachineSource> machine,
    const Random& optics) {
  TRY(Within("frame width", options.view.frame_width_px, 64, kSensorWidthPx));
  TRY(Within("frame height", options.view.frame_height_px, 64, kSensorHeightPx));
  TRY(Within("frames per second", options.frames_per_s, 1, 1000));
  auto server = std::make_unique<Running>(options, std::move(machine), optics);
  TRY(server->Start());
  return server;
}

}  // namespace trammel::sim
