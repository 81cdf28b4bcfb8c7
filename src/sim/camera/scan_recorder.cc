#include "sim/camera/scan_recorder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "files/new_file.h"
#include "image/avi_writer.h"
#include "sim/camera/jpeg.h"
#include "sim/print/bead.h"

namespace trammel::sim {
namespace {

using nlohmann::ordered_json;

constexpr double kNominalPxPerMm = 41;  // user's value; the camera's own scale differs

// Line in the camera's frame, where it runs along +x or -x.
struct PatternLine {
  double start_mm = 0;
  double direction = 1;  // print direction, along x
  double across_mm = 0;
  bool along_y = false;  // on the bed; the camera is then rotated by 90 degrees
};

PatternLine StrokeOf(const PlannedLine& line) {
  PatternLine stroke;
  stroke.along_y =
      std::abs(line.end_y_mm - line.start_y_mm) > std::abs(line.end_x_mm - line.start_x_mm);
  const double end = stroke.along_y ? line.end_y_mm : line.end_x_mm;
  stroke.start_mm = stroke.along_y ? line.start_y_mm : line.start_x_mm;
  stroke.across_mm = stroke.along_y ? -line.start_x_mm : line.start_y_mm;
  stroke.direction = end > stroke.start_mm ? 1 : -1;
  return stroke;
}

// Rotates the bed so that its y axis becomes the camera's x axis.
Bed Turned(const Bed& bed) {
  Bed turned = bed;
  for (Strand& strand : turned.strands) {
    for (BeadSample& sample : strand.samples) {
      sample = {sample.y_mm,     -sample.x_mm,     sample.area_mm2,
                sample.width_mm, sample.height_mm, sample.base_mm};
    }
  }
  return turned;
}

// Returns capture times from the first frame on, increasing.
std::vector<double> CaptureTimes(int frames, double frames_per_s, double jitter_s, Random& random) {
  std::vector<double> times;
  for (int i = 0; i < frames; ++i) {
    const double jitter =
        std::clamp(random.Normal(0, jitter_s), -0.4 / frames_per_s, 0.4 / frames_per_s);
    times.push_back(i / frames_per_s + jitter);
  }
  // Rounded to the microsecond, like a camera's times; times start at 0.
  const double first = times.front();
  for (double& time : times) time = std::round((time - first) * 1e6) / 1e6;
  return times;
}

Result<void> WriteJson(const std::filesystem::path& path, const ordered_json& value) {
  const std::string text = value.dump(1, ' ', false, ordered_json::error_handler_t::replace) + "\n";
  return files::WriteWholeFile(path, text, files::IfThere::kRefuse);
}

// Sweeps one line into its video.
Result<void> RecordLine(const Bed& bed, const PatternLine& stroke, const LaserTraits& optics,
                        const ScanOptions& options, const std::vector<double>& times_s,
                        LaserCamera& camera, Random& random, const std::filesystem::path& video) {
  const auto laser_at = [&](double time_s) {
    return stroke.start_mm +
           stroke.direction * (options.skip_mm + options.scan_speed_mm_s * time_s) +
           optics.position_error_mm;
  };
  const LaserScene scene =
      camera.MakeScene(bed, stroke.across_mm, laser_at(0), laser_at(times_s.back()));
  auto file = TRY(files::NewFile::Create(video, files::IfThere::kRefuse));
  image::AviWriter writer(file.fd());
  int error = writer.Begin(
      {options.frame_width_px, options.frame_height_px, static_cast<double>(options.frames_per_s)});
  const double phase = random.Uniform(0, 2 * std::numbers::pi);
  const double travel_mm = stroke.direction * options.scan_speed_mm_s * optics.exposure_s;
  Frame frame;
  std::vector<std::uint8_t> jpeg;
  for (const double time_s : times_s) {
    const double gain = 1 + optics.gain_drift * std::sin(phase + 2 * std::numbers::pi * time_s /
                                                                     optics.gain_period_s);
    camera.Render(scene, laser_at(time_s), travel_mm, gain, random, frame);
    EncodeJpeg(frame.view(), optics.jpeg_quality, jpeg);
    if (error == 0) error = writer.Add(jpeg);
    if (error != 0) return files::CannotWrite(video, error);
  }
  error = writer.Finish();
  if (error != 0) return files::CannotWrite(video, error);
  return file.Commit();
}

ordered_json ScanHead(const Plan& plan, const LaserTraits& optics, const ScanOptions& options,
                      const SensorWindow& window) {
  ordered_json scan;
  scan["format"] = 1;
  scan["eye"] = "laser";
  scan["frames_per_s"] = options.frames_per_s;
  scan["scan_speed_mm_s"] = options.scan_speed_mm_s;
  constexpr double kDegree = std::numbers::pi / 180;
  scan["px_per_mm"] = options.set_up ? options.set_up->px_per_mm : kNominalPxPerMm;
  scan["laser_angle_deg"] =
      (options.set_up ? options.set_up->laser_angle_rad : optics.laser_angle_rad) / kDegree;
  if (options.set_up) {
    scan["px_per_mm_sigma"] = options.set_up->px_per_mm_sigma;
    scan["laser_angle_sigma_deg"] = options.set_up->laser_angle_sigma_rad / kDegree;
  }
  scan["commanded_area_mm2"] = StadiumArea(plan.line_width_mm, plan.layer_height_mm);
  scan["height_direction"] = "-x";
  scan["crop_px"] = {{"x", 837 - window.x}, {"y", 341 - window.y}, {"width", 45}, {"height", 60}};
  if (options.opaque_plate) scan["plate"] = "opaque";
  scan["line_start_mm"] = options.skip_mm;
  scan["line_length_mm"] = plan.line_length_mm;
  for (const PlannedSegment& segment : plan.segments) {
    scan["segments"].push_back(
        {{"fraction", segment.fraction}, {"speed_mm_s", segment.speed_mm_s}});
  }
  scan["acceleration_mm_s2"] = plan.acceleration_mm_s2;
  return scan;
}

Result<void> CreateFolder(const std::filesystem::path& folder) {
  std::error_code error;
  if (std::filesystem::exists(folder, error)) {
    return Fail(fmt::format("{} exists already; nothing is overwritten: choose another folder",
                            folder.string()));
  }
  std::filesystem::create_directories(folder, error);
  if (error) {
    return Fail(
        fmt::format("{}: the folder cannot be created: {}", folder.string(), error.message()));
  }
  return {};
}

}  // namespace

SetUpScale DrawSetUpScale(const LaserTraits& optics, Random& random) {
  // Standard errors of tests/integration/setup_study.cc.
  constexpr double kScaleShare = 0.002;
  constexpr double kAngle_rad = 0.12 * std::numbers::pi / 180;
  // Beside the optical axis a rising surface also moves outwards, as it comes nearer.
  const double beside_mm = (optics.stripe_column_px - kSensorWidthPx / 2.0) / optics.px_per_mm;
  const double angle_rad =
      std::atan(std::tan(optics.laser_angle_rad) - beside_mm / optics.distance_mm);
  return {optics.px_per_mm * (1 + random.Normal(0, kScaleShare)), kScaleShare * optics.px_per_mm,
          angle_rad + random.Normal(0, kAngle_rad), kAngle_rad};
}

ScanOptions ScanOptionsFor(const Plan& plan) {
  constexpr double kShortSpeed_mm_s = 20;
  constexpr double kShortSkip_mm = 0.8;
  ScanOptions options;
  if (plan.segments.empty()) return options;
  if (plan.segments.front().fraction * plan.line_length_mm > options.skip_mm) return options;
  options.scan_speed_mm_s = kShortSpeed_mm_s;
  options.skip_mm = kShortSkip_mm;
  return options;
}

Result<void> RecordScan(const Bed& bed, const Plan& plan, const Condition& condition,
                        const LaserTraits& optics, const ScanOptions& options, const Random& random,
                        const std::filesystem::path& folder) {
  const double sweep_mm = plan.line_length_mm - 2 * options.skip_mm;
  const double frame_mm = options.scan_speed_mm_s / options.frames_per_s;
  if (sweep_mm < frame_mm) {
    return Fail(fmt::format("lines of {} mm are too short: {} mm are skipped at either end",
                            plan.line_length_mm, options.skip_mm));
  }
  const SensorWindow window = WindowAroundCrop(options.frame_width_px, options.frame_height_px);
  ordered_json scan = ScanHead(plan, optics, options, window);
  scan["lines"] = ordered_json::array();
  LaserCamera camera(condition, optics, window, random.Fork(1));
  const Bed turned = Turned(bed);
  const int frames = static_cast<int>(std::floor(sweep_mm / frame_mm + 1e-9));
  for (const PlannedLine& line : plan.lines) {
    if (line.pattern != options.pattern) continue;
    const std::size_t index = scan["lines"].size();
    if (index == 0) {
      TRY(CreateFolder(folder));
    }
    Random line_random = random.Fork(1000 + index);
    const std::vector<double> times_s =
        CaptureTimes(frames, options.frames_per_s, optics.frame_jitter_s, line_random);
    const PatternLine stroke = StrokeOf(line);
    const std::string video = fmt::format("line{}.avi", index);
    TRY(RecordLine(stroke.along_y ? turned : bed, stroke, optics, options, times_s, camera,
                   line_random, folder / video));
    const std::string direction =
        std::string(stroke.direction > 0 ? "+" : "-") + (stroke.along_y ? "y" : "x");
    scan["lines"].push_back({{"pressure_advance_s", line.pressure_advance_s},
                             {"video", video},
                             {"print_direction", direction},
                             {"sweep_direction", direction},
                             {"frame_times_s", times_s}});
  }
  if (scan["lines"].empty()) {
    return Fail(fmt::format("the plan has no line of pattern {}", options.pattern));
  }
  return WriteJson(folder / "scan.json", scan);
}

Result<void> WriteTruth(const std::filesystem::path& folder, const PrintTruth& truth,
                        std::uint64_t seed, const std::string& condition) {
  return WriteTruthFile(folder / "truth.json", truth, seed, condition);
}

Result<void> WriteTruthFile(const std::filesystem::path& path, const PrintTruth& truth,
                            std::uint64_t seed, const std::string& condition) {
  return WriteJson(path, {{"format", 1},
                          {"pressure_advance_s", truth.pressure_advance_s},
                          {"flow_factor", truth.flow_factor},
                          {"seed", seed},
                          {"condition", condition}});
}

}  // namespace trammel::sim
