// Camera in the virtual mill's spindle, over a printed board, as an MJPEG stream.
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
  int port = 0;                       ///< on 127.0.0.1; 0: a free one
  SpindlePicture like;                ///< light, clutter and eye of its pictures
  std::vector<RingPattern> patterns;  ///< one for each mark
  int jpeg_quality = 95;              ///< 1 … 100
  /// Limit of the spindle's reported X, beyond which the board is in shadow.
  double dark_beyond_x_mm = std::numeric_limits<double>::infinity();
};

/// Draws a picture whenever the machine has come to rest; repeats the last one while it moves.
class MillCamera {
 public:
  /// @param board  with one stop, which is where the machine stands and how it is turned at first
  /// Error (kMachine): a port in use.
  [[nodiscard]] static Result<std::unique_ptr<MillCamera>> Start(
      const MillCameraOptions& options, BoardWorld board, std::shared_ptr<const VirtualMill> mill);
  virtual ~MillCamera() = default;
  [[nodiscard]] virtual int port() const = 0;
};

/// Returns the truth of board and camera, in JSON. The camera is as in align calibrate's result,
/// with its place in the taper as the spindle carries it; the touches are those of `touched`.
[[nodiscard]] std::string MillTruthJson(const BoardWorld& board);

}  // namespace trammel::sim
