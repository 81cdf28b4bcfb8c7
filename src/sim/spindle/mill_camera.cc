#include "sim/spindle/mill_camera.h"

#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstring>
#include <mutex>
#include <nlohmann/json.hpp>
#include <numbers>
#include <thread>
#include <utility>

#include "base/bug_note.h"
#include "base/check.h"
#include "base/frame.h"
#include "sim/camera/camera_http.h"
#include "sim/camera/jpeg.h"
#include "sim/spindle/spindle_files.h"

namespace trammel::sim {
namespace {

constexpr double kFrame_s = 0.1;
constexpr std::uint64_t kApproach = 21;
constexpr std::uint64_t kTurn = 22;
constexpr std::uint64_t kPicture = 23;

class Camera final : public MillCamera {
 public:
  Camera(const MillCameraOptions& options, BoardWorld board,
         std::shared_ptr<const VirtualMill> mill)
      : options_(options), board_(std::move(board)), mill_(std::move(mill)) {
    first_index_rad_ = board_.index_rad.front();
  }
  ~Camera() override {
    {
      const std::lock_guard lock(mutex_);
      stopping_ = true;
    }
    changed_.notify_all();
    if (thread_.joinable()) thread_.join();
  }
  int port() const override { return http_->port(); }

  Result<void> Begin() {
    http_ = TRY(
        CameraHttp::Listen(options_.port, CameraHeaders::kNone, [](const CameraPart&, double) {}));
    thread_ = std::thread([this] { (void)NoteBug([this] { Run(); }); });
    return {};
  }

 private:
  void Run() {
    std::unique_lock lock(mutex_);
    while (!changed_.wait_for(lock, std::chrono::duration<double>(kFrame_s),
                              [this] { return stopping_; })) {
      lock.unlock();
      if (http_->wanted()) Show();
      lock.lock();
    }
  }

  void Show() {
    const MillPlace before = mill_->At(MonotonicNow());
    const bool new_place =
        !jpeg_ || before.approach != shown_.approach || before.turn != shown_.turn;
    if (!before.moving && new_place) {
      auto jpeg = Draw(before);
      const MillPlace after = mill_->At(MonotonicNow());
      // If it moved meanwhile, the picture is outdated.
      if (after.approach != before.approach || after.turn != before.turn) return;
      jpeg_ = std::move(jpeg);
      shown_ = before;
    }
    if (!jpeg_) return;
    CameraPart part;
    part.frame = ++frame_;
    part.jpeg = jpeg_;
    part.width_px = board_.setup.lens.width_px;
    part.height_px = board_.setup.lens.height_px;
    http_->Publish(std::move(part), MonotonicNow());
  }

  std::shared_ptr<const std::vector<std::uint8_t>> Draw(const MillPlace& place) {
    Random approach = board_.noise.Fork(kApproach).Fork(place.approach);
    board_.setup.stops.front() = {place.stated_mm, place.c_deg * std::numbers::pi / 180};
    board_.actual_mm.front() = ActualFor(board_, place.stated_mm, approach);
    Random turned = board_.noise.Fork(kTurn).Fork(place.turn);
    board_.index_rad.front() =
        place.turn == 0 ? first_index_rad_ : turned.Normal(0, board_.setup.machine.index_rad);
    SpindlePicture picture = BoardPictureAt(board_, 0, options_.patterns, options_.like);
    if (place.stated_mm[0] > options_.dark_beyond_x_mm) {
      constexpr double kNight = 5;  // grey levels
      picture.light.white = picture.light.dark = picture.light.surface = kNight;
    }
    const auto page = TakePicture(picture, board_.noise.Fork(kPicture).Fork(place.approach));
    TRAMMEL_CHECK(page.has_value(), "{}", page ? std::string() : page.error().message);
    Frame frame(page->width, page->height);
    for (int y = 0; y < page->height; ++y) {
      std::uint8_t* to = frame.row(y);
      const std::uint8_t* from = page->samples.data() + std::ptrdiff_t{y} * page->width;
      for (int x = 0; x < page->width; ++x) std::memset(to + std::ptrdiff_t{3} * x, from[x], 3);
    }
    auto jpeg = std::make_shared<std::vector<std::uint8_t>>();
    EncodeJpeg(frame.view(), options_.jpeg_quality, *jpeg);
    return jpeg;
  }

  MillCameraOptions options_;
  BoardWorld board_;
  std::shared_ptr<const VirtualMill> mill_;
  double first_index_rad_ = 0;
  std::shared_ptr<const std::vector<std::uint8_t>> jpeg_;
  MillPlace shown_;
  std::int64_t frame_ = 0;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool stopping_ = false;
  std::unique_ptr<CameraHttp> http_;
  std::thread thread_;
};

// Inverts eq. 2 of the paper; beta within a quarter turn.
Triple AnglesOf(const Turn& turn) {
  return {std::atan2(turn[2][1], turn[2][2]), -std::asin(turn[2][0]),
          std::atan2(turn[1][0], turn[0][0])};
}

}  // namespace

Result<std::unique_ptr<MillCamera>> MillCamera::Start(const MillCameraOptions& options,
                                                      BoardWorld board,
                                                      std::shared_ptr<const VirtualMill> mill) {
  TRAMMEL_CHECK(board.setup.stops.size() == 1, "{} stops", board.setup.stops.size());
  auto camera = std::make_unique<Camera>(options, std::move(board), std::move(mill));
  TRY(camera->Begin());
  return camera;
}

std::string MillTruthJson(const BoardWorld& board) {
  using Json = nlohmann::ordered_json;
  SpindleLens lens = board.setup.lens;
  const Place held = TaperFromCameraAsHeld(board);
  lens.offset_mm = held.origin_mm;
  lens.angles_rad = AnglesOf(held.turn);
  Json touches = Json::array();
  for (const BoardTouchStation& touch : board.touches) {
    touches.push_back({{"mark", touch.mark}, {"spindle_mm", touch.stated_mm}});
  }
  const Json json = {{"format", 1},
                     {"camera", SpindleCameraJson(lens)},
                     {"tool_length_mm", board.setup.tool_length_mm},
                     {"touches", touches}};
  return json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace trammel::sim
