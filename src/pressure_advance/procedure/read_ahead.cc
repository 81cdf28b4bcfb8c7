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

}  // namespace

ReadAhead::ReadAhead()
    : worker_([this](const std::stop_token& stop) { (void)NoteBug([&] { Work(stop); }); }) {}

void ReadAhead::Add(std::filesystem::path folder, Scan scan) {
  TRAMMEL_CHECK(scan.crop && scan.lines.size() == 1, "a crop: {}, {} lines", scan.crop.has_value(),
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
  std::unique_lock lock(mutex_);
  std::erase_if(waiting_, [&](const Line& one) { return one.video == video; });
  auto found = read_.extract(video);
  lock.unlock();
  if (found.empty()) return std::nullopt;
  Read& read = found.mapped();
  const bool same = SameRect(read.crop, *scan.crop) && read.size.width == size.width &&
                    read.size.height == size.height &&
                    read.height_direction == scan.height_direction;
  if (!same || !CheckCount(line, read.line.frames.size())) return std::nullopt;
  for (std::size_t i = 0; i < read.line.frames.size(); ++i) {
    if (!IsPlaced(line, i)) read.line.frames[i] = {};  // keeps its number; nobody may look at it
  }
  return std::move(read.line);
}

void ReadAhead::Work(const std::stop_token& stop) {
  LowerThisThread();
  std::unique_lock lock(mutex_);
  while (changed_.wait(lock, stop, [this] { return !waiting_.empty(); }) &&
         !stop.stop_requested()) {
    const Line line = std::move(waiting_.front());
    waiting_.pop_front();
    if (bytes_ > kMostBytes) continue;
    reading_ = true;
    lock.unlock();
    Read read{*line.scan.crop, line.scan.height_direction, {}, {}};
    bool whole = false;
    (void)NoteBug([&] {
      const ScanLine& placed = line.scan.lines.front();
      ScanLine all = placed;  // frames that have no place now may get one from the lines to come
      all.frame_positions_mm.clear();
      const auto path = VideoOf(line.folder, placed);
      const auto size = SizeOf(line.folder, line.scan);
      if (!path || !size) return;
      auto frames = ReadFrames(*path, line.scan, all, *size);
      if (!frames) return;  // said by who reads it again
      read.size = *size;
      read.line.frames = std::move(*frames);
      vision::LaserLineWorkspace workspace;
      read.line.reading = ReadSweep(read.line.frames, line.scan, placed, {}, workspace);
      whole = true;
    });
    lock.lock();
    for (const Frame& frame : read.line.frames) bytes_ += frame.bgr.size();
    if (whole) read_.insert_or_assign(line.video, std::move(read));
    reading_ = false;
    changed_.notify_all();
  }
}

}  // namespace trammel::procedure
