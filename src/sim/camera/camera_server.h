// What can go wrong with a camera, on purpose and reproducibly.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <deque>
#include <filesystem>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "base/random.h"
#include "base/result.h"
#include "sim/camera/camera_http.h"
#include "sim/camera/camera_view.h"
#include "sim/camera/head_rig.h"

namespace trammel::sim {

enum class CameraFaultKind {
  kStall,        ///< connections stay open, nothing arrives; what was seen meanwhile is lost
  kDropFrames,   ///< each frame is lost with probability `fraction`
  kTimeJump,     ///< capture stamps are off by jump_s
  kSizeChange,   ///< frames have another size: cut, or with black borders
  kHalfJpeg,     ///< a frame breaks off in its middle and its connection closes
  kClose,        ///< connections are closed; new ones too
  kBlack,        ///< frames are black
  kLaserAbsent,  ///< the laser does not shine
};

struct CameraFault {
  CameraFaultKind kind = CameraFaultKind::kStall;
  double at_s = 0;                            ///< when it begins, from the start of the server
  std::optional<std::int64_t> at_frame = {};  ///< or with which frame, counted from 0
  double duration_s = std::numeric_limits<double>::infinity();  ///< 0: one frame
  double fraction = 0.5;                                        ///< of kDropFrames, 0 … 1
  double jump_s = 0;                                            ///< of kTimeJump
  int width_px = 640;                                           ///< of kSizeChange, 16 … 1920
  int height_px = 480;                                          ///< 16 … 1080
};

/// What the faults of one moment add up to.
struct ActiveFaults {
  bool stall = false;
  bool half_jpeg = false;
  bool close = false;
  bool black = false;
  bool laser_absent = false;
  double drop_fraction = 0;
  double jump_s = 0;
  std::optional<CameraFault> size;
};

/// Faults over time. Not safe for several threads at once.
class CameraFaults {
 public:
  /// REQUIRES values within the bounds above.
  void Add(const CameraFault& fault);

  /// What is wrong with one frame. Call once for every frame, in order of time: a fault shorter
  /// than a frame hits the first frame after its beginning.
  /// @param time_s  of its capture, from the start of the server.
  [[nodiscard]] ActiveFaults At(std::int64_t frame, double time_s);

 private:
  struct Entry {
    CameraFault fault;
    std::optional<double> begun_s;
  };
  std::vector<Entry> entries_;
};

/// One frame that at least one client was sent. Times on the host's monotonic clock.
struct CameraTruth {
  std::int64_t frame = 0;    ///< from the server's start, lost ones counted
  double capture_s = 0;      ///< the true middle of its exposure
  double stamp_s = 0;        ///< what its headers say
  double sent_s = 0;         ///< when its way to the first client began
  MachineView machine;       ///< at mid-exposure
  CameraView::Spot spot;     ///< where the laser meets the plate at the focus height
  bool shown_black = false;  ///< by a fault
  bool laser_hidden = false;
  bool half = false;
};

/// Keeps the latest 100,000 frames (an hour at 30 frames/s); with a file, all. Safe to use from
/// several threads.
class CameraTruthLog {
 public:
  CameraTruthLog() = default;
  /// Also writes a JSON object per line to a new file, each as soon as it is known.
  /// Error (kInput): the file cannot be created.
  [[nodiscard]] Result<void> WriteTo(const std::filesystem::path& path);

  void Add(const CameraTruth& truth);
  [[nodiscard]] std::vector<CameraTruth> rows() const;

 private:
  static constexpr std::size_t kMostRows = 100000;
  mutable std::mutex mutex_;
  std::deque<CameraTruth> rows_;
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::unique_ptr<std::FILE, Close> file_;
};

struct CameraServerOptions {
  int port = 0;  ///< on 127.0.0.1; 0 takes a free one
  CameraHeaders headers = CameraHeaders::kUstreamer6;
  Condition condition;  ///< plate and filament; the machine says whether there is light
  CameraViewOptions view;
  double frames_per_s = 30;  ///< of host time, 1 … 1000; frames that cannot be drawn are lost
  double machine_time_scale = 1;  ///< how many times faster than life the machine runs, 0.1 … 1000
  double latency_s = 0.04;        ///< shortest time from mid-exposure to sending, 0 … 2
  double latency_jitter_s = 0.05;  ///< sending is later by 0 … this, uniformly; 0 … 2
  int jpeg_quality = 90;           ///< 1 … 100
  std::vector<CameraFault> faults;
  std::filesystem::path truth_file;  ///< JSON lines, one per frame sent; empty: none
};

/// Frames are drawn only while somebody watches. One thread draws, one serves.
class CameraServer {
 public:
  /// @param eye     Names the eye: see DrawHeadEye, which CameraServer calls with it. Equal
  ///                generators, equal eyes and textures.
  /// Errors: (kInput) a frame of another size; a truth file that cannot be created; (kMachine) a
  /// port in use.
  [[nodiscard]] static Result<std::unique_ptr<CameraServer>> Start(
      const CameraServerOptions& options, std::shared_ptr<const MachineSource> machine,
      const Random& eye);

  virtual ~CameraServer() = default;  ///< Closes every connection.

  [[nodiscard]] virtual int port() const = 0;
  /// Adds a fault; its at_s counts from now. REQUIRES values within CameraFault's bounds.
  virtual void Inject(const CameraFault& fault) = 0;
  /// Every frame sent so far, oldest first.
  [[nodiscard]] virtual std::vector<CameraTruth> truth() const = 0;
  /// The eye that looks: its traits are truth as well.
  [[nodiscard]] virtual const HeadEye& eye() const = 0;
};

}  // namespace trammel::sim
