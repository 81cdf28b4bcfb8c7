// Filament that lies on the bed already: what a bead rests on, and what is beside it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "sim/print/surface.h"

namespace trammel::sim {

/// Piece of a bead as its neighbours feel it: a rectangle across the path.
struct LaidPiece {
  double x_mm = 0;
  double y_mm = 0;
  double z_mm = 0;     ///< nozzle height
  double along_x = 1;  ///< unit vector of the path
  double along_y = 0;
  double half_mm = 0;  ///< half of area over height
};

/// Free distance from the path to the beads of the same layer on either side, mm; infinite where
/// there are none within reach.
struct FreeRoom {
  double left_mm = 0;
  double right_mm = 0;
};

/// Beads of one layer push each other aside only where they run in about the same direction: a bead
/// that crosses another lies on it.
class LaidBeads {
 public:
  /// Nozzle heights closer than this are one layer, mm.
  static constexpr double kSameLayerMm = 0.03;

  explicit LaidBeads(const BedRegion& region);

  /// Returns the top of the highest layer below the nozzle; 0: the plate; negative: nothing, but
  /// the piece lies outside the region.
  [[nodiscard]] double BaseAt(double x_mm, double y_mm, double z_mm) const;
  [[nodiscard]] FreeRoom RoomBeside(const LaidPiece& piece) const;
  /// Adds the pieces of one finished strand.
  void Add(const std::vector<LaidPiece>& strand);

 private:
  struct Column {
    float below_mm = 0;    // top of the layer below the highest one
    float highest_mm = 0;  // top of the highest layer
  };

  void Raise(double x_mm, double y_mm, double z_mm);
  [[nodiscard]] std::size_t BucketAt(double x_mm, double y_mm) const;
  void Insert(double x_mm, double y_mm, const LaidPiece& piece);

  BedRegion region_;
  double cell_mm_ = 0.1;
  std::ptrdiff_t columns_ = 0;
  std::ptrdiff_t rows_ = 0;
  std::vector<Column> tops_;
  double bucket_mm_ = 0.3;
  std::ptrdiff_t bucket_columns_ = 0;
  std::ptrdiff_t bucket_rows_ = 0;
  std::vector<std::vector<LaidPiece>> buckets_;  // of the layer printed last in each
};

}  // namespace trammel::sim
