// Frames of a laser line: a width, then a few frames' pixels one after another.
#include <cmath>
#include <vector>

#include "base/frame.h"
#include "fuzz.h"
#include "vision/laser_line.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  constexpr std::size_t kFrames = 3;
  constexpr int kNarrowest = 3;
  if (size < 1) return 0;
  const int width = kNarrowest + data[0] % 64;
  const int height = static_cast<int>((size - 1) / kFrames / (3 * static_cast<std::size_t>(width)));
  if (height < 1) return 0;
  std::vector<BgrView> frames;
  for (std::size_t i = 0; i < kFrames; ++i) {
    frames.push_back({data + 1 + i * static_cast<std::size_t>(3 * width * height), width, height,
                      std::ptrdiff_t{3} * width});
  }
  vision::LaserLineWorkspace workspace;
  const vision::LaserLineOptions options;
  const vision::StripeModel model = vision::LearnStripe(frames, options, workspace);
  for (const BgrView& frame : frames) {
    vision::LaserLine line;
    vision::FindLaserLine(frame, model, options, workspace, line);
    fuzz::Require(line.centre_px.size() == static_cast<std::size_t>(height) &&
                      line.sigma_px.size() == static_cast<std::size_t>(height),
                  "each row has a sample");
    for (std::size_t row = 0; row < line.centre_px.size(); ++row) {
      fuzz::Require(std::isfinite(line.centre_px[row]) && std::isfinite(line.sigma_px[row]),
                    "never a centre that is no number");
      fuzz::Require(line.found(row) || line.centre_px[row] == 0, "a row without a stripe has none");
    }
  }
  return 0;
}
