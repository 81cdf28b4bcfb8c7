#include "pressure_advance/procedure/read_ahead.h"

#include <algorithm>
#include <utility>

#include "base/bug_note.h"
#include "base/check.h"
#include "base/thread_priority.h"

namespace trammel::procedure {
namespace {

using pressure_advance::Scan;
using pressure_advance::ScanLine;

constexpr std::size_t kMostBytes = std::size_t{256} << 20;

bool SameRect(const PixelRect& one, const PixelRect& other) {
  return one.x == other.x && one.y == other.y && one.width == other.width &&
         one.height == other.height;
}

// Which of its video's lines a line of the scan is.
std::size_t OrdinalOf(const Scan& scan, const ScanLine& line) {
  std::size_t ordinal = 0;
  for (const ScanLine& one : scan.lines) {
    if (&one == &line) break;
    ordinal += one.video == line.video;
  }
  return ordinal;
}

}  // namespace

ReadAhead::ReadAhead()
    : worker_([this](const std::stop_token& stop) { (void)NoteBug([&] { Work(stop); }); }) {}

void ReadAhead::Add(std::filesystem::path folder, Scan scan) {
  TRAMMEL_CHECK(scan.crop && !scan.lines.empty(), "a crop: {}, {} lines", scan.crop.has_value(),
                scan.lines.size());
  const std::lock_guard lock(mutex_);
  std::filesystem::path video = folder / scan.lines.front().video;
  waiting_.push_back({std::move(video), std::move(folder), std::move(scan)});
  changed_.notify_all();
}

void ReadAhead::WaitForAll() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return waiting_.empty() && !reading_; });
}

std::optional<LineAhead> ReadAhead::Take(const std::filesystem::path& folder, const Scan& scan,
                                         const ScanLine& line, const FrameSize& size) {
  const std::filesystem::path video = folder / line.video;
  const std::lock_guard lock(mutex_);
  std::erase_if(waiting_, [&](const Video& one) { return one.path == video; });
  const auto found = read_.find(video);
  if (found == read_.end()) return std::nullopt;
  Read& read = found->second;
  const bool same = SameRect(read.crop, *scan.crop) && read.size.width == size.width &&
                    read.size.height == size.height &&
                    read.height_direction == scan.height_direction;
  const std::size_t ordinal = OrdinalOf(scan, line);
  if (!same || !CheckCount(line, read.frames.size()) || ordinal >= read.lines.size() ||
      !read.lines[ordinal]) {
    return std::nullopt;
  }
  LineAhead ahead{std::vector<Frame>(read.frames.size()), *std::move(read.lines[ordinal])};
  read.lines[ordinal].reset();
  for (std::size_t i = 0; i < read.frames.size(); ++i) {
    // What is not this line's keeps its number; nobody may look at it.
    if (IsPlaced(line, i)) ahead.frames[i] = std::move(read.frames[i]);
  }
  const bool all_taken = std::none_of(read.lines.begin(), read.lines.end(),
                                      [](const auto& one) { return one.has_value(); });
  if (all_taken) read_.erase(found);
  return ahead;
}

void ReadAhead::Work(const std::stop_token& stop) {
  LowerThisThread();
  std::unique_lock lock(mutex_);
  while (changed_.wait(lock, stop, [this] { return !waiting_.empty(); }) &&
         !stop.stop_requested()) {
    const Video video = std::move(waiting_.front());
    waiting_.pop_front();
    if (bytes_ > kMostBytes) continue;
    reading_ = true;
    lock.unlock();
    Read read{*video.scan.crop, video.scan.height_direction, {}, {}, {}};
    bool whole = false;
    (void)NoteBug([&] {
      ScanLine all = video.scan.lines.front();
      all.frame_positions_mm.clear();  // frames may get a place from the lines to come
      const auto path = VideoOf(video.folder, all);
      const auto size = SizeOf(video.folder, video.scan);
      if (!path || !size) return;
      auto frames = ReadFrames(*path, video.scan, all, *size);
      if (!frames) return;  // said by who reads it again
      read.size = *size;
      read.frames = std::move(*frames);
      vision::LaserLineWorkspace workspace;
      for (const ScanLine& line : video.scan.lines) {
        read.lines.emplace_back(ReadSweep(read.frames, video.scan, line, {}, workspace));
      }
      whole = true;
    });
    lock.lock();
    for (const Frame& frame : read.frames) bytes_ += frame.bgr.size();
    if (whole) read_.insert_or_assign(video.path, std::move(read));
    reading_ = false;
    changed_.notify_all();
  }
}

}  // namespace trammel::procedure
