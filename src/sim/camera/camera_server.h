// Faults of a camera, on purpose and reproducible.
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
  double at_s = 0;                            ///< start, from the start of the server
  std::optional<std::int64_t> at_frame = {};  ///< or with which frame, counted from 0
  double duration_s = std::numeric_limits<double>::infinity();  ///< 0: one frame
  double fraction = 0.5;                                        ///< kDropFrames only, 0 … 1
  double jump_s = 0;                                            ///< kTimeJump only
  int width_px = 640;                                           ///< kSizeChange only, 16 … 1920
  int height_px = 480;                                          ///< 16 … 1080
};

/// Sum of the active faults at one moment.
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

/// Faults over time. Not thread-safe.
class CameraFaults {
 public:
  /// REQUIRES values within the bounds above.
  void Add(const CameraFault& fault);

  /// Returns the faults of one frame. Call once for every frame, in order of time: a fault shorter
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

/// Frame sent to at least one client. Times on the host's monotonic clock.
struct CameraTruth {
  std::int64_t frame = 0;    ///< from the server's start, including lost ones
  double capture_s = 0;      ///< the true middle of its exposure
  double stamp_s = 0;        ///< from its headers
  double sent_s = 0;         ///< start of transmission to the first client
  MachineView machine;       ///< at mid-exposure
  CameraView::Spot spot;     ///< laser spot on the plate at the focus height
  bool shown_black = false;  ///< true due to a fault
  bool laser_hidden = false;
  bool half = false;
};

/// Stores the latest 100,000 frames (an hour at 30 frames/s); with a file, all. Thread-safe.
class CameraTruthLog {
 public:
  CameraTruthLog() = default;
  /// Also writes a JSON object per line to a new file, as soon as it is known.
  /// Error (kInput): the file cannot be created.
  [[nodiscard]] Result<void> WriteTo(const std::filesystem::path& path);

  void Add(const CameraTruth& truth);
  [[nodiscard]] std::vector<CameraTruth> rows() const;

 private:
  static constexpr std::size_t kMaxRows = 100000;
  mutable std::mutex mutex_;
  std::deque<CameraTruth> rows_;
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::unique_ptr<std::FILE, Close> file_;
};

struct CameraServerOptions {
  int port = 0;  ///< on 127.0.0.1; 0: a free one
  CameraHeaders headers = CameraHeaders::kUstreamer6;
  Condition condition;  ///< plate and filament; the machine says whether there is light
  CameraViewOptions view;
  double frames_per_s = 30;        ///< in host time, 1 … 1000; frames not drawn in time are lost
  double machine_time_scale = 1;   ///< speed of the machine relative to real time, 0.1 … 1000
  double latency_s = 0.04;         ///< shortest time from mid-exposure to sending, 0 … 2
  double latency_jitter_s = 0.05;  ///< sending is later by 0 … this, uniformly; 0 … 2
  int jpeg_quality = 90;           ///< 1 … 100
  std::vector<CameraFault> faults;
  std::filesystem::path truth_file;  ///< JSON lines, one per frame sent; empty: none
};

/// Camera server. Frames are drawn only while a client is connected. One thread draws, one serves.
class CameraServer {
 public:
  /// @param eye     Names the eye: see DrawHeadOptics, which CameraServer calls with it. Equal
  ///                generators, equal eyes and textures.
  /// Errors: (kInput) a frame of another size; a truth file that cannot be created; (kMachine) a
  /// port in use.
  [[nodiscard]] static Result<std::unique_ptr<CameraServer>> Start(
      const CameraServerOptions& options, std::shared_ptr<const MachineSource> machine,
      const Random& optics);

  virtual ~CameraServer() = default;  ///< Closes every connection.

  [[nodiscard]] virtual int port() const = 0;
  /// Adds a fault; its at_s counts from now. REQUIRES values within CameraFault's bounds.
  virtual void Inject(const CameraFault& fault) = 0;
  /// Returns every frame sent so far, oldest first.
  [[nodiscard]] virtual std::vector<CameraTruth> truth() const = 0;
  /// Returns the rendering camera: its traits are part of the truth.
  [[nodiscard]] virtual const HeadOptics& optics() const = 0;
};

}  // namespace trammel::sim
