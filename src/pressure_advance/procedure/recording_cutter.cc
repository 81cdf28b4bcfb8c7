#include "pressure_advance/procedure/recording_cutter.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "base/check.h"
#include "machine/video/video_cutter.h"
#include "pressure_advance/files/recording.h"
#include "pressure_advance/laser/laser_eye.h"
#include "pressure_advance/procedure/recorded_frames.h"

namespace trammel::procedure {
namespace {

using pressure_advance::Scan;
using pressure_advance::ScanLine;

constexpr double kWholeEvery_s = 6;

Result<void> CheckReadable(const std::vector<Frame>& frames, const Scan& scan,
                           const ScanLine& line) {
  vision::LaserLineWorkspace workspace;
  const auto reading = ReadSweep(frames, scan, line, {}, workspace);
  if (!reading.profile.unusable.empty()) {
    return Fail(reading.profile.unusable, ErrorKind::kMeasurement);
  }
  if (reading.cut_off_frames == 0) return {};
  return Fail(fmt::format("the bead reaches out of the crop in {} frames", reading.cut_off_frames),
              ErrorKind::kMeasurement);
}

bool SamePixels(const std::vector<Frame>& one, const std::vector<Frame>& other) {
  return std::equal(one.begin(), one.end(), other.begin(), other.end(),
                    [](const Frame& a, const Frame& b) { return a.bgr == b.bgr; });
}

// Cuts a video (machine/video/video_cutter.h), once each of its lines reads well within the crop
// and every frame's crop is the same to the bit in the cut. A whole frame stays every 6 s.
// @param scan  with the crop and the lines of this video alone
// Errors, which leave the video whole: a line cannot be read, or its bead reaches out of the crop;
// the video's, the disk's, kInterrupted.
Result<void> CutVideo(const std::filesystem::path& folder, const Scan& scan,
                      const std::stop_token& stop) {
  TRAMMEL_CHECK(scan.crop && !scan.lines.empty(), "a crop: {}, {} lines", scan.crop.has_value(),
                scan.lines.size());
  const ScanLine& line = scan.lines.front();
  const auto video = TRY(VideoOf(folder, line));
  const auto size = TRY(SizeOf(folder, scan));
  ScanLine all = line;  // frames that have no place now may get one from the lines to come
  all.frame_positions_mm.clear();
  const auto whole = TRY(ReadFrames(video, scan, all, size));
  for (const ScanLine& one : scan.lines) {
    TRY(CheckReadable(whole, scan, one));
  }
  const double whole_every = std::max(1.0, std::round(kWholeEvery_s * scan.frames_per_s));
  auto cut = TRY(machine::CutVideo::Write(
      video, {*scan.crop, static_cast<std::size_t>(whole_every), scan.frames_per_s}, stop));
  const auto again = TRY(ReadFrames(cut.path(), scan, all, size));
  if (!SamePixels(whole, again)) {
    return Fail("its cut does not read as the whole does", ErrorKind::kMeasurement);
  }
  return cut.TakePlace();
}

}  // namespace

std::vector<std::string> CutRecording(const std::filesystem::path& folder,
                                      const std::stop_token& stop) {
  auto scan = files::ReadScan(folder);
  if (!scan) return {scan.error().message};
  if (!scan->crop) scan->crop = scan->found_crop;
  if (!scan->crop) return {};
  std::map<std::string, Scan> videos;  // with the lines of each alone
  Scan without_lines = *scan;
  without_lines.lines.clear();
  for (ScanLine& line : scan->lines) {
    videos.emplace(line.video, without_lines).first->second.lines.push_back(std::move(line));
  }
  std::vector<std::string> whole;
  for (const auto& [video, of_video] : videos) {
    if (stop.stop_requested()) break;
    if (const auto cut = CutVideo(folder, of_video, stop); !cut) {
      whole.push_back(fmt::format("{} keeps its whole frames: {}", video, cut.error().message));
    }
  }
  return whole;
}

}  // namespace trammel::procedure
