// Frames of a laser line: a width, then a few frames' pixels one after another.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include "base/frame.h"
#include "fuzz.h"
#include "pressure_advance/laser/laser_crop.h"
#include "vision/laser_line.h"

namespace {

using namespace trammel;

void FindLines(const std::vector<Frame>& frames, vision::LaserLineWorkspace& workspace) {
  std::vector<BgrView> views;
  for (const Frame& frame : frames) views.push_back(frame.view());
  const vision::LaserLineOptions options;
  const vision::StripeModel model = vision::LearnStripe(views, options, workspace);
  for (const BgrView& view : views) {
    vision::LaserLine line;
    vision::FindLaserLine(view, model, options, workspace, line);
    const auto rows = static_cast<std::size_t>(view.height);
    fuzz::Require(line.centre_px.size() == rows && line.sigma_px.size() == rows,
                  "each row has a sample");
    for (std::size_t row = 0; row < rows; ++row) {
      fuzz::Require(std::isfinite(line.centre_px[row]) && std::isfinite(line.sigma_px[row]),
                    "never a centre that is no number");
      fuzz::Require(line.found(row) || line.centre_px[row] == 0, "a row without a stripe has none");
    }
  }
}

}  // namespace

TRAMMEL_FUZZ_TARGET(laser_frames)(const std::uint8_t* data, std::size_t size) {
  constexpr std::size_t kFrames = 3;
  constexpr std::size_t kMostRows = 14;  // each line that is tried is judged by all of them
  if (size < 1) return 0;
  const int width = 1 + data[0] % 32;
  const std::size_t rows = (size - 1) / kFrames / (3 * static_cast<std::size_t>(width));
  const int height = static_cast<int>(std::min(rows, kMostRows));
  if (height < 1) return 0;
  std::vector<Frame> frames(kFrames, Frame(width, height));
  for (std::size_t i = 0; i < kFrames; ++i) {
    std::memcpy(frames[i].bgr.data(), data + 1 + i * frames[i].bgr.size(), frames[i].bgr.size());
  }
  vision::LaserLineWorkspace workspace;
  if (width >= vision::kNarrowestFrame_px) FindLines(frames, workspace);
  for (const auto direction : {AxisDirection::kMinusX, AxisDirection::kPlusX}) {
    const auto found = pressure_advance::FindCrop(frames, direction, workspace);
    if (!found.crop) {
      fuzz::Require(!found.fault.empty(), "where there is no crop, it is said why");
      continue;
    }
    (void)Crop(frames[0].view(), *found.crop);  // a Bug where it is not within
  }
  return 0;
}
