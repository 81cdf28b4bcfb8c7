// What can go wrong with a camera, on purpose and reproducibly.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

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

}  // namespace trammel::sim
