// Targets that read pixels: pages, photos, frames, videos.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include "base/frame.h"
#include "base/page.h"
#include "fuzz.h"
#include "image/jpeg_cutter.h"
#include "image/jpeg_outline.h"
#include "image/jpeg_reader.h"
#include "machine/camera/image_file.h"
#include "machine/camera/raw_picture.h"
#include "machine/page/page_file.h"
#include "machine/video/avi_reader.h"
#include "machine/video/video_file.h"
#include "part_alignment/targets/ring_finder.h"
#include "pressure_advance/laser/deviation.h"
#include "pressure_advance/laser/laser_reader.h"
#include "pressure_advance/laser/stripe_observation.h"
#include "pressure_advance/recording/scan.h"
#include "vision/laser_line.h"

namespace trammel::fuzz {
namespace {

// A recording's AVI file, cut into its frames.
FUZZ_TARGET(avi_reader)(std::string_view text) {
  constexpr std::size_t kMaxBytes = 1 << 20;
  static const MemoryFile file("line.avi");
  file.Write(text);
  auto avi = machine::AviReader::Open(file.path(), kMaxBytes);
  if (!Good(avi)) return;
  std::size_t bytes = 0;
  double last_s = -1;
  for (machine::AviFrame frame;;) {
    const auto next = avi->Next(frame);
    if (!Good(next) || !*next) return;
    bytes += frame.bytes.size();
    Require(!frame.bytes.empty() && bytes <= text.size(), "each byte is part of one frame");
    const double time_s = frame.time_s.value_or(last_s + 1);
    Require(time_s > last_s, "times ascend");
    last_s = time_s;
  }
}

using image::JpegDamage;
using image::JpegPixels;
using image::JpegReader;

constexpr double kMaxPixels = 1 << 20;

std::vector<std::uint8_t> Pixels(std::span<const std::uint8_t> jpeg, const PixelRect& part) {
  auto reader = JpegReader::Open(jpeg, JpegDamage::kRefuse);
  if (!reader || !reader->StartPart(JpegPixels::kBgr, part)) return {};
  const auto row_bytes = 3 * static_cast<std::size_t>(part.width);
  std::vector<std::uint8_t> pixels(row_bytes * static_cast<std::size_t>(part.height));
  for (int y = 0; y < part.height; ++y) {
    if (!reader->ReadRow(pixels.data() + static_cast<std::size_t>(y) * row_bytes)) return {};
  }
  return pixels;
}

// JPEG frames cut to a part: x, y, width and height of the part in 16 bits each, then the picture.
FUZZ_TARGET(jpeg_cut)(std::string_view text) {
  std::int16_t numbers[4];
  if (text.size() < sizeof numbers) return;
  std::memcpy(numbers, text.data(), sizeof numbers);
  const PixelRect part{numbers[0], numbers[1], numbers[2], numbers[3]};
  const std::span<const std::uint8_t> jpeg = Bytes(text).subspan(sizeof numbers);
  const auto outline = image::OutlineOf(jpeg);
  if (!Good(outline) || !image::CheckCost(*outline, jpeg.size()) ||
      static_cast<double>(outline->width_px) * outline->height_px > kMaxPixels) {
    return;
  }
  std::vector<std::uint8_t> bytes;
  if (!Good(image::CutJpeg(jpeg, part, bytes))) return;
  const auto cut = JpegReader::Open(bytes, JpegDamage::kRefuse);
  Require(cut.has_value(), "a cut is a JPEG");
  const auto place = cut->header().place.value_or(image::JpegPlace{});
  const auto pixels = Pixels(bytes, {part.x - place.x, part.y - place.y, part.width, part.height});
  Require(!pixels.empty() && pixels == Pixels(jpeg, part), "a cut has the whole's pixels");
}

void FindLines(const std::vector<Frame>& frames, vision::LaserLineWorkspace& workspace) {
  std::vector<BgrView> views;
  for (const Frame& frame : frames) views.push_back(frame.view());
  const vision::LaserLineOptions options;
  const vision::StripeModel model = vision::LearnStripe(views, options, workspace);
  for (const BgrView& view : views) {
    vision::LaserLine line;
    vision::FindLaserLine(view, model, options, workspace, line);
    const auto rows = static_cast<std::size_t>(view.height);
    Require(line.centre_px.size() == rows && line.sigma_px.size() == rows, "each row has a sample");
    for (std::size_t row = 0; row < rows; ++row) {
      Require(std::isfinite(line.centre_px[row]) && std::isfinite(line.sigma_px[row]),
              "never a centre that is no number");
      Require(line.found(row) || line.centre_px[row] == 0, "a row without a stripe has none");
    }
  }
}

// Frames of a laser line: a width, then a few frames' pixels one after another.
FUZZ_TARGET(laser_frames)(std::string_view text) {
  constexpr std::size_t kFrames = 3;
  constexpr std::size_t kMaxRows = 14;  // each line that is tried is judged by all of them
  const std::span<const std::uint8_t> bytes = Bytes(text);
  if (bytes.empty()) return;
  const int width = 1 + bytes[0] % 32;
  const std::size_t rows = (bytes.size() - 1) / kFrames / (3 * static_cast<std::size_t>(width));
  const int height = static_cast<int>(std::min(rows, kMaxRows));
  if (height < 1) return;
  std::vector<Frame> frames(kFrames, Frame(width, height));
  for (std::size_t i = 0; i < kFrames; ++i) {
    std::memcpy(frames[i].bgr.data(), &bytes[1 + i * frames[i].bgr.size()], frames[i].bgr.size());
  }
  vision::LaserLineWorkspace workspace;
  if (width >= vision::kNarrowestFrame_px) FindLines(frames, workspace);
  for (const auto direction : {AxisDirection::kMinusX, AxisDirection::kPlusX}) {
    const auto found = pressure_advance::FindCrop(frames, direction, workspace);
    if (!found.crop) {
      Require(!found.fault.empty(), "where there is no crop, it is said why");
      continue;
    }
    (void)Crop(frames[0].view(), *found.crop);  // a Bug where it is not within
  }
}

constexpr std::size_t kHead = 3;
constexpr int kSmallest_px = 8;  // limit of a crop
constexpr int kSweepFrames = 8;

std::vector<Frame> FramesOf(std::span<const std::uint8_t> data) {
  // Few pixels: each line that is tried is judged by all of them.
  const Frame blank(kSmallest_px + data[0] % 8, kSmallest_px + data[1] % 8);
  std::vector<Frame> frames(kSweepFrames, blank);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    for (std::size_t k = 0; k < frames[i].bgr.size(); ++k) {
      frames[i].bgr[k] = data[kHead + (i + k) % (data.size() - kHead)];
    }
  }
  return frames;
}

// A sweep of very small frames: width, height and how it was swept, then pixels that all frames
// take in turn, each beginning one further on.
FUZZ_TARGET(laser_sweep)(std::string_view text) {
  const std::span<const std::uint8_t> data = Bytes(text);
  if (data.size() <= kHead) return;
  const std::vector<Frame> frames = FramesOf(data);
  pressure_advance::Scan scan;
  scan.scan_speed_mm_s = 40;
  scan.motion.length_mm = 30;
  scan.motion.acceleration_mm_s2 = 3000;
  scan.motion.segments = {{0.25, 5}, {0.5, 150}, {0.25, 5}};
  if ((data[2] & 1) != 0) scan.px_per_mm = 20;
  if ((data[2] & 2) != 0) scan.height_direction = AxisDirection::kPlusX;
  pressure_advance::ScanLine line;
  line.video = "line.avi";
  for (int i = 0; (data[2] & 4) != 0 && i < kSweepFrames; ++i) {
    line.frame_positions_mm.emplace_back(i % 5 == 4 ? std::nullopt : std::optional(1.25 * i));
  }
  scan.lines = {line};
  if (!Good(pressure_advance::Validate(scan))) return;
  vision::LaserLineWorkspace workspace;
  const auto reading = pressure_advance::ReadSweep(frames, scan, line, {}, workspace);
  for (const pressure_advance::ProfileSample& sample : reading.profile.samples) {
    Require(std::isfinite(sample.position), "a sample has a place");
  }
  const auto paper =
      pressure_advance::DeviationHeights(frames, reading.frame, scan.height_direction);
  const auto score = pressure_advance::DeviationScore(paper);
  Require(!score || std::isfinite(*score), "a score is a number");
}

// Scanned pages: each that is read has a size and all its samples.
void ReadAsPages(const MemoryFile& file, std::string_view bytes) {
  file.Write(bytes);
  const auto pages = machine::ReadPages(file.path());
  if (!Good(pages)) return;
  Require(!pages->empty(), "a file that can be read has a page");
  for (const Page& page : *pages) {
    Require(page.width >= 1 && page.height >= 1, "a page has a size");
    Require(page.samples.size() ==
                static_cast<std::size_t>(page.stride()) * static_cast<std::size_t>(page.height),
            "a page has all its samples");
  }
}

#define PAGE_TARGET(kind)                           \
  FUZZ_TARGET(page_##kind)(std::string_view text) { \
    static const MemoryFile file("page." #kind);    \
    ReadAsPages(file, text);                        \
  }

PAGE_TARGET(jpeg)
PAGE_TARGET(pdf)
PAGE_TARGET(png)
PAGE_TARGET(tiff)

// Photos and frames: JPEG and PNG.
FUZZ_TARGET(photo)(std::string_view text) {
  const std::span<const std::uint8_t> bytes = Bytes(text);
  const auto header = machine::ReadImageHeader(bytes);
  if (Good(header)) {
    Require(header->width_px >= 1 && header->height_px >= 1, "a picture has a size");
    (void)machine::EndsEarly(bytes, header->format);
  }
  const auto frame = machine::DecodeImage(bytes);
  Require(!Good(frame) || header, "a picture without a header is not decoded");
}

// Raw pixels as industrial cameras send them: pixel format, width, height and padding, then bytes.
FUZZ_TARGET(raw_picture)(std::string_view text) {
  struct Head {
    std::uint32_t pixel_format;
    std::int16_t width;
    std::int16_t height;
    std::uint16_t padding;
  } head{};
  constexpr std::size_t kBytes = 10;
  if (text.size() < kBytes) return;
  std::memcpy(&head, text.data(), kBytes);
  machine::RawPicture raw;
  raw.pixel_format = head.pixel_format;
  raw.width_px = head.width;
  raw.height_px = head.height;
  raw.row_padding_bytes = head.padding;
  raw.bytes = Bytes(text).subspan(kBytes);
  (void)machine::PixelFormatName(raw.pixel_format);
  constexpr int kQuality = 90;
  for (const int quality : {0, kQuality}) {
    const auto picture = machine::ToPicture(raw, quality);
    Require(!Good(picture) || machine::IsReadPixelFormat(raw.pixel_format),
            "only formats that are read give a picture");
  }
}

void RequireSense(const Result<part_alignment::FoundTargets>& found, const PageView& picture) {
  if (!Good(found)) return;
  for (const part_alignment::FoundTarget& target : found->targets) {
    Require(std::isfinite(target.disc.column_px) && std::isfinite(target.disc.row_px),
            "a target has a centre");
    Require(target.disc.column_px > -1 && target.disc.column_px < picture.width &&
                target.disc.row_px > -1 && target.disc.row_px < picture.height,
            "a target lies in the picture");
    Require(target.sigma_column_px > 0 && target.sigma_row_px > 0,
            "a centre is uncertain, and by how much is known");
  }
}

// Pictures of targets: a width, then grey pixels.
FUZZ_TARGET(target_picture)(std::string_view text) {
  const std::span<const std::uint8_t> bytes = Bytes(text);
  if (bytes.size() < 2) return;
  PageView picture;
  picture.data = &bytes[1];
  picture.width = bytes[0];
  if (picture.width == 0) return;
  picture.height = static_cast<int>((bytes.size() - 1) / static_cast<std::size_t>(picture.width));
  picture.stride = picture.width;
  constexpr int kBits = 8;
  static const auto rings = part_alignment::MakeCodeBook(kBits);
  part_alignment::FinderWorkspace workspace;
  part_alignment::FinderOptions options;
  options.plain_discs = true;
  RequireSense(part_alignment::FindTargets(picture, *rings, options, workspace), picture);
}

// A recording's video.
FUZZ_TARGET(video_file)(std::string_view text) {
  static const MemoryFile file("line.avi");
  file.Write(text);
  auto video = machine::VideoFile::Open(file.path());
  if (!Good(video)) return;
  for (;;) {
    const auto frame = video->Next();
    if (!Good(frame) || *frame == nullptr) return;
  }
}

}  // namespace
}  // namespace trammel::fuzz
