// The camera in the virtual mill's spindle, over a printed board, as an MJPEG stream.
#pragma once

#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "base/result.h"
#include "sim/spindle/mill.h"
#include "sim/spindle/spindle_board.h"

namespace trammel::sim {

struct MillCameraOptions {
  int port = 0;                       ///< on 127.0.0.1; 0 takes a free one
  SpindlePicture like;                ///< light, clutter and eye of its pictures
  std::vector<RingPattern> patterns;  ///< one for each mark
  int jpeg_quality = 95;              ///< 1 … 100
  /// Where the spindle's stated X is beyond it, something keeps the light off the board.
  double dark_beyond_x_mm = std::numeric_limits<double>::infinity();
};

/// Draws a picture wherever the machine has come to rest; while it moves, the last one goes on.
class MillCamera {
 public:
  /// @param board  with one stop, which is where the machine stands and how it is turned at first
  /// Error (kMachine): a port in use.
  [[nodiscard]] static Result<std::unique_ptr<MillCamera>> Start(
      const MillCameraOptions& options, BoardWorld board, std::shared_ptr<const VirtualMill> mill);
  virtual ~MillCamera() = default;
  [[nodiscard]] virtual int port() const = 0;
};

/// What is true of board and camera, in JSON: the camera as align calibrate gives it, with its
/// place in the taper as the spindle carries it, and how the marks of `touched` were touched.
[[nodiscard]] std::string MillTruthJson(const BoardWorld& board);

}  // namespace trammel::sim
