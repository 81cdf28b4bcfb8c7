// The virtual printer's camera: frames of a virtual machine over HTTP, in the host's real time.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "base/random.h"
#include "base/result.h"
#include "sim/camera/camera_fault.h"
#include "sim/camera/camera_http.h"
#include "sim/camera/camera_truth.h"
#include "sim/camera/camera_view.h"
#include "sim/camera/machine_view.h"

namespace trammel::sim {

struct CameraServerOptions {
  int port = 0;  ///< on 127.0.0.1; 0 takes a free one
  CameraHeaders headers = CameraHeaders::kUstreamer6;
  Condition condition;  ///< plate and filament; the machine says whether there is light
  CameraViewOptions view;
  double frames_per_s = 30;  ///< of host time, 1 … 1000; frames that cannot be drawn are lost
  double machine_time_scale = 1;  ///< how many times faster than life the machine runs, 0.1 … 1000
  double stamp_after_s = 0;       ///< headers' capture time after mid-exposure, -0.1 … 0.1
  double stamp_resolution_s =
      1e-3;                 ///< stamps are cut to whole multiples, as ustreamer's; 0 … 0.01
  double latency_s = 0.04;  ///< shortest time from mid-exposure to sending, 0 … 2
  double latency_jitter_s = 0.05;  ///< sending is later by 0 … this, uniformly; 0 … 2
  int jpeg_quality = 90;           ///< 1 … 100
  std::vector<CameraFault> faults;
  std::filesystem::path truth_file;  ///< JSON lines, one per frame sent; empty: none

  /// Error (kInput) names the first field out of bounds.
  [[nodiscard]] Result<void> Validate() const;
};

/// How many frames there were since the start.
struct CameraCounts {
  std::int64_t drawn = 0;    ///< handed to the clients' side
  std::int64_t late = 0;     ///< lost because drawing fell behind
  std::int64_t dropped = 0;  ///< per client, because it was too slow
  double drawing_s = 0;      ///< time spent on drawing and encoding
};

/// Frames are drawn only while somebody watches. One thread draws, one serves.
class CameraServer {
 public:
  /// @param eye     Names the eye: see DrawHeadEye, which CameraServer calls with it. Equal
  ///                generators, equal eyes and textures.
  /// Errors: (kInput) options; a truth file that cannot be created; (kMachine) a port in use.
  [[nodiscard]] static Result<std::unique_ptr<CameraServer>> Start(
      const CameraServerOptions& options, std::shared_ptr<const MachineSource> machine,
      const Random& eye);

  virtual ~CameraServer() = default;  ///< Closes every connection.

  [[nodiscard]] virtual int port() const = 0;
  /// Adds a fault; its at_s counts from now. REQUIRES values within CameraFault's bounds.
  virtual void Inject(const CameraFault& fault) = 0;
  /// Every frame sent so far, oldest first.
  [[nodiscard]] virtual std::vector<CameraTruth> truth() const = 0;
  [[nodiscard]] virtual CameraCounts counts() const = 0;
  /// The eye that looks: its traits are truth as well.
  [[nodiscard]] virtual const HeadEye& eye() const = 0;
};

}  // namespace trammel::sim
