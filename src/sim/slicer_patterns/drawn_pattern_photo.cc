#include "sim/slicer_patterns/drawn_pattern_photo.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "sim/photo/photo.h"
#include "sim/print/printer.h"

namespace trammel::sim {
namespace {

// Random streams of a world; new parts get new numbers, so that old worlds are unchanged.
enum PatternStream : std::uint64_t { kSettings = 1, kMachine, kBeads, kCamera, kPixels };

template <class Value, std::size_t count>
Value OneOf(const std::array<Value, count>& values, Random& random) {
  return values[random.Below(count)];
}

void DrawLineOptions(PatternOptions& options, Random& random) {
  if (options.kind == PatternKind::kOrcaLine) {
    options.bars = static_cast<int>(random.Below(3));
    options.step_s = OneOf(std::array{0.002, 0.004, 0.005}, random);
    options.fast_mm_s = OneOf(std::array{60.0, 100.0, 120.0, 200.0}, random);
    options.slow_mm_s = std::max(10.0, options.fast_mm_s / 10);
    options.acceleration_mm_s2 = OneOf(std::array{500.0, 1000.0, 3000.0, 5000.0, 10000.0}, random);
    options.numbers = random.Uniform() < 0.8;
    return;
  }
  options.slow_mm_s = OneOf(std::array{5.0, 20.0}, random);
  options.fast_mm_s = OneOf(std::array{70.0, 100.0, 120.0}, random);
  options.acceleration_mm_s2 = OneOf(std::array{500.0, 1000.0, 3000.0}, random);
  options.frame = random.Uniform() < 0.7;
  options.prime = random.Uniform() < 0.5;
  options.numbers = random.Uniform() < 0.7;
  options.rotation_deg = random.Uniform() < 0.8 ? 0 : 45 * static_cast<int>(random.Below(8));
  options.absolute_e = random.Uniform() < 0.3;
}

}  // namespace

PatternOptions DrawPatternOptions(PatternKind kind, Random& random) {
  PatternOptions options = PatternDefaults(kind);
  const bool lines = kind == PatternKind::kOrcaLine || kind == PatternKind::kMarlinLines;
  constexpr std::array kFirmwares = {PatternFirmware::kKlipper, PatternFirmware::kMarlin,
                                     PatternFirmware::kRepRap};
  options.firmware = OneOf(kFirmwares, random);
  if (lines) {
    DrawLineOptions(options, random);
  } else {
    options.end_s = OneOf(std::array{0.06, 0.08}, random);
    options.step_s = OneOf(std::array{0.004, 0.005}, random);
    options.fast_mm_s = OneOf(std::array{60.0, 100.0, 150.0}, random);
    options.acceleration_mm_s2 = OneOf(std::array{1000.0, 2000.0, 3000.0, 5000.0, 10000.0}, random);
    if (kind == PatternKind::kEllis && random.Uniform() < 0.3) options.spacing_mm = 3;
  }
  if (kind == PatternKind::kOrcaBatch) {
    options.end_s = 0.06;  // nine of them fit on a bed of 250 mm
    options.step_s = 0.005;
    options.speeds_mm_s = {50, 100, 150};
    options.accelerations_mm_s2 = {1000, 3000, 10000};
  }
  options.corner_mm_s = OneOf(std::array{0.0, 5.0, 8.0}, random);
  options.smooth_time_s = OneOf(std::array{-1.0, 0.02, 0.04}, random);
  options.comments = random.Uniform() < 0.3;
  return options;
}

Result<DrawnPatternPhoto> DrawPatternPhoto(PatternKind kind, std::uint64_t seed,
                                           const PatternPhotoOptions& options) {
  const Random world = Random(seed).Fork(1000 + static_cast<std::uint64_t>(kind));
  Random settings = world.Fork(kSettings);
  DrawnPatternPhoto drawn;
  drawn.kind = kind;
  drawn.pattern = DrawPatternOptions(kind, settings);
  if (options.pattern) drawn.pattern = *options.pattern;
  SlicerPattern pattern = TRY(WriteSlicerPattern(drawn.pattern));
  drawn.gcode = std::move(pattern.gcode);
  drawn.values = std::move(pattern.pressure_advance_s);

  const double first = drawn.values.front();
  const double range = drawn.values.back() - first;
  const double k_star = first + range * settings.Uniform(options.least_share, options.most_share);
  drawn.exponent = settings.Uniform(options.least_exponent, options.most_exponent);
  if (!(k_star >= 1e-4 && k_star <= 10 && drawn.exponent >= 0.2 && drawn.exponent <= 1)) {
    return Fail(fmt::format(
        "a pressure advance of {} s and an exponent of {}: must be 0.0001 ... 10 and 0.2 ... 1",
        k_star, drawn.exponent));
  }
  Random machine = world.Fork(kMachine);
  PrinterTraits traits = DrawTraits(k_star, machine);
  traits.law.kind = StorageKind::kPower;
  traits.law.exponent = drawn.exponent;
  traits.bed_size_x_mm = drawn.pattern.bed_x_mm;
  traits.bed_size_y_mm = drawn.pattern.bed_y_mm;
  Random beads = world.Fork(kBeads);
  const Print print = TRY(PrintGcode(drawn.gcode, traits, beads));
  drawn.truth = print.truth;

  Random camera = world.Fork(kCamera);
  const PhotoScene scene = DrawPhotoScene(camera);
  drawn.scene = options.scene.value_or(scene);
  drawn.phone =
      DrawPhonePhoto(drawn.scene, options.width_px, options.height_px, options.distortion, camera);
  drawn.photo = TRY(RenderPhoto(print.bed, drawn.phone, world.Fork(kPixels)));
  return drawn;
}

}  // namespace trammel::sim
