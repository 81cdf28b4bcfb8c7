// Pictures of targets: a width, then grey pixels.
#include <cmath>

#include "base/page.h"
#include "fuzz.h"
#include "part_alignment/targets/ring_finder.h"

namespace {

using namespace trammel;

void RequireSense(const Result<part_alignment::FoundTargets>& found, const PageView& picture) {
  if (!fuzz::Good(found)) return;
  for (const part_alignment::FoundTarget& target : found->targets) {
    fuzz::Require(std::isfinite(target.disc.column_px) && std::isfinite(target.disc.row_px),
                  "a target has a centre");
    fuzz::Require(target.disc.column_px > -1 && target.disc.column_px < picture.width &&
                      target.disc.row_px > -1 && target.disc.row_px < picture.height,
                  "a target lies in the picture");
    fuzz::Require(target.sigma_column_px > 0 && target.sigma_row_px > 0,
                  "a centre is uncertain, and by how much is known");
  }
}

}  // namespace

TRAMMEL_FUZZ_TARGET(target_picture)(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  PageView picture;
  picture.data = data + 1;
  picture.width = data[0];
  if (picture.width == 0) return 0;
  picture.height = static_cast<int>((size - 1) / static_cast<std::size_t>(picture.width));
  picture.stride = picture.width;
  constexpr int kBits = 8;
  static const auto rings = part_alignment::MakeCodeBook(kBits);
  part_alignment::FinderWorkspace workspace;
  part_alignment::FinderOptions options;
  options.plain_discs = true;
  RequireSense(part_alignment::FindTargets(picture, *rings, options, workspace), picture);
  return 0;
}
