#include "sim/print/laid_beads.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace trammel::sim {
namespace {

constexpr double kMostCells = 10e6;
constexpr double kMostBuckets = 1e6;
constexpr double kReachMm = 1;        // neighbours further away push nothing
constexpr double kAbreastMm = 0.045;  // half of the pieces' distance along their path, and a little
constexpr double kSameWay = 0.7;      // cosine: 45 degrees

}  // namespace

LaidBeads::LaidBeads(const BedRegion& region) : region_(region) {
  const double width = region.max_x_mm - region.min_x_mm;
  const double depth = region.max_y_mm - region.min_y_mm;
  cell_mm_ = std::max(cell_mm_, std::sqrt(width * depth / kMostCells));
  columns_ = static_cast<std::ptrdiff_t>(width / cell_mm_) + 1;
  rows_ = static_cast<std::ptrdiff_t>(depth / cell_mm_) + 1;
  tops_.resize(static_cast<std::size_t>(columns_ * rows_));
  bucket_mm_ = std::max(bucket_mm_, std::sqrt(width * depth / kMostBuckets));
  bucket_columns_ = static_cast<std::ptrdiff_t>(width / bucket_mm_) + 1;
  bucket_rows_ = static_cast<std::ptrdiff_t>(depth / bucket_mm_) + 1;
  buckets_.resize(static_cast<std::size_t>(bucket_columns_ * bucket_rows_));
}

double LaidBeads::BaseAt(double x_mm, double y_mm, double z_mm) const {
  if (!region_.Contains(x_mm, y_mm)) return 0;
  const auto column = static_cast<std::ptrdiff_t>((x_mm - region_.min_x_mm) / cell_mm_);
  const auto row = static_cast<std::ptrdiff_t>((y_mm - region_.min_y_mm) / cell_mm_);
  const Column& here = tops_[static_cast<std::size_t>(row * columns_ + column)];
  const auto highest = static_cast<double>(here.highest_mm);
  return highest < z_mm - kSameLayerMm ? highest : static_cast<double>(here.below_mm);
}

std::size_t LaidBeads::BucketAt(double x_mm, double y_mm) const {
  const auto column = static_cast<std::ptrdiff_t>((x_mm - region_.min_x_mm) / bucket_mm_);
  const auto row = static_cast<std::ptrdiff_t>((y_mm - region_.min_y_mm) / bucket_mm_);
  return static_cast<std::size_t>(row * bucket_columns_ + column);
}

FreeRoom LaidBeads::RoomBeside(const LaidPiece& piece) const {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  FreeRoom room{kFar, kFar};
  auto last = buckets_.size();
  // Half of the finest bucket: none is skipped.
  for (double off = -kReachMm; off <= kReachMm; off += bucket_mm_ / 2) {
    const double x = piece.x_mm - off * piece.along_y;
    const double y = piece.y_mm + off * piece.along_x;
    if (!region_.Contains(x, y)) continue;
    const std::size_t bucket = BucketAt(x, y);
    if (bucket == last) continue;
    last = bucket;
    for (const LaidPiece& other : buckets_[bucket]) {
      const double dx = other.x_mm - piece.x_mm;
      const double dy = other.y_mm - piece.y_mm;
      if (std::abs(other.z_mm - piece.z_mm) > kSameLayerMm ||
          std::abs(dx * piece.along_x + dy * piece.along_y) > kAbreastMm) {
        continue;
      }
      const double same = std::abs(other.along_x * piece.along_x + other.along_y * piece.along_y);
      const double left = dy * piece.along_x - dx * piece.along_y;
      // A bead on the same path lies below, not beside.
      if (same < kSameWay || std::abs(left) < piece.half_mm / 2) continue;
      double& free = left > 0 ? room.left_mm : room.right_mm;
      free = std::min(free, std::abs(left) - other.half_mm);
    }
  }
  return room;
}

void LaidBeads::Insert(double x_mm, double y_mm, const LaidPiece& piece) {
  if (!region_.Contains(x_mm, y_mm)) return;
  std::vector<LaidPiece>& bucket = buckets_[BucketAt(x_mm, y_mm)];
  if (!bucket.empty() && std::abs(bucket.back().z_mm - piece.z_mm) > kSameLayerMm) bucket.clear();
  const bool there =
      !bucket.empty() && bucket.back().x_mm == piece.x_mm && bucket.back().y_mm == piece.y_mm;
  if (!there) bucket.push_back(piece);
}

void LaidBeads::Raise(double x_mm, double y_mm, double z_mm) {
  if (!region_.Contains(x_mm, y_mm)) return;
  const auto column = static_cast<std::ptrdiff_t>((x_mm - region_.min_x_mm) / cell_mm_);
  const auto row = static_cast<std::ptrdiff_t>((y_mm - region_.min_y_mm) / cell_mm_);
  Column& here = tops_[static_cast<std::size_t>(row * columns_ + column)];
  const auto z = static_cast<float>(z_mm);
  if (z_mm > static_cast<double>(here.highest_mm) + kSameLayerMm) {
    here.below_mm = here.highest_mm;
    here.highest_mm = z;
  } else {
    here.highest_mm = std::max(here.highest_mm, z);
  }
}

void LaidBeads::Add(const std::vector<LaidPiece>& strand) {
  for (std::size_t i = 0; i < strand.size(); ++i) {
    const LaidPiece& piece = strand[i];
    if (piece.half_mm <= 0 || !region_.Contains(piece.x_mm, piece.y_mm)) continue;
    const auto steps = static_cast<int>(std::ceil(piece.half_mm / (0.7 * cell_mm_)));
    for (int k = -steps; k <= steps; ++k) {
      const double off = piece.half_mm * k / steps;
      Raise(piece.x_mm - off * piece.along_y, piece.y_mm + off * piece.along_x, piece.z_mm);
    }
    // Every second piece is enough for its neighbours; each is where they look for it.
    if (i % 2 != 0) continue;
    const double ahead = kAbreastMm / std::sqrt(2.0);
    Insert(piece.x_mm - ahead * piece.along_x, piece.y_mm - ahead * piece.along_y, piece);
    Insert(piece.x_mm + ahead * piece.along_x, piece.y_mm + ahead * piece.along_y, piece);
  }
}

}  // namespace trammel::sim
