#include "machine/scanner/frame_assembler.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace trammel::machine {
namespace {

Result<void> Contradiction(const std::string& what) {
  return Fail(fmt::format("{}; switch the scanner off and on, and scan again", what),
              ErrorKind::kMachine);
}

bool IsOneColor(FrameHead::Colors colors) {
  return colors != FrameHead::Colors::kGrey && colors != FrameHead::Colors::kRgb;
}

}  // namespace

Result<void> FrameAssembler::Begin(const FrameHead& head) {
  if (open_ || !expects_more_) return Contradiction("the scanner begins a frame within another");
  head_ = head;
  layout_ = {};
  layout_.width = head.width_px;
  layout_.height = std::max(head.lines, 1);
  layout_.samples = head.colors == FrameHead::Colors::kRgb ? 3 : 1;
  layout_.bits = head.bits;
  layout_.white_is_zero = head.bits == 1;
  auto frame = MakePage(layout_, limits_);
  if (!frame)
    return tl::unexpected(Error{frame.error().kind, "the scan: " + frame.error().message});
  const std::int64_t needed = (layout_.width * layout_.samples * layout_.bits + 7) / 8;
  // Twice: some pad their lines.
  if (head.bytes_per_line < needed || head.bytes_per_line > 2 * needed + 4096) {
    return Contradiction(fmt::format("the scanner sends {} bytes a line where {} are needed",
                                     head.bytes_per_line, needed));
  }
  frame_ = std::move(*frame);
  frame_.samples.clear();  // what it has reserved stays
  frame_.height = 0;
  begun_line_.clear();
  open_ = true;
  return {};
}

Result<void> FrameAssembler::AddLine(std::span<const std::uint8_t> line) {
  if (head_.lines > 0 && frame_.height == head_.lines) return {};  // padding at the end
  if ((std::int64_t{frame_.height} + 1) * frame_.width > limits_.most_pixels) {
    return Fail(fmt::format(
        "the scan has more than the {} megapixels that are read; scan a smaller area or with "
        "fewer dpi (600 are enough)",
        limits_.most_pixels / 1'000'000));
  }
  frame_.samples.resize(frame_.samples.size() + static_cast<std::size_t>(frame_.stride()));
  FillRow(layout_, line, frame_.height++, frame_);
  return {};
}

Result<void> FrameAssembler::Add(std::span<const std::uint8_t> samples) {
  if (!open_) return Contradiction("the scanner sends samples of no frame");
  const auto line = static_cast<std::size_t>(head_.bytes_per_line);
  while (!samples.empty()) {
    if (begun_line_.empty() && samples.size() >= line) {
      if (auto added = AddLine(samples.first(line)); !added) return added;
      samples = samples.subspan(line);
      continue;
    }
    const std::size_t count = std::min(line - begun_line_.size(), samples.size());
    begun_line_.insert(begun_line_.end(), samples.begin(),
                       samples.begin() + static_cast<std::ptrdiff_t>(count));
    samples = samples.subspan(count);
    if (begun_line_.size() < line) break;
    if (auto added = AddLine(begun_line_); !added) return added;
    begun_line_.clear();
  }
  return {};
}

Result<void> FrameAssembler::End() {
  if (!open_) return Contradiction("the scanner ends a frame that it has not begun");
  open_ = false;
  expects_more_ = head_.last == 0;
  // Drivers announce some lines more than come; a page that is short of a tenth was broken off.
  if (frame_.height == 0 || frame_.height * 10LL < head_.lines * 9LL) {
    return Fail(fmt::format("the scan ended after {} of {} lines: look at cable and network, and "
                            "scan again",
                            frame_.height, std::max(head_.lines, 1)),
                ErrorKind::kMachine);
  }
  if (IsOneColor(head_.colors)) return MergeColor();
  expects_more_ = false;
  page_ = std::move(frame_);
  return {};
}

Result<void> FrameAssembler::MergeColor() {
  if (page_.samples.empty()) {
    page_.width = frame_.width;
    page_.height = frame_.height;
    page_.channels = 3;
    page_.samples.resize(3 * frame_.samples.size());
  }
  if (page_.width != frame_.width || page_.height != frame_.height) {
    return Contradiction(fmt::format("the scanner's colours differ in size: {} x {} and {} x {} px",
                                     page_.width, page_.height, frame_.width, frame_.height));
  }
  const std::size_t channel = head_.colors == FrameHead::Colors::kBlue    ? 0
                              : head_.colors == FrameHead::Colors::kGreen ? 1
                                                                          : 2;
  for (std::size_t i = 0; i < frame_.samples.size(); ++i) {
    page_.samples[3 * i + channel] = frame_.samples[i];
  }
  return {};
}

void FrameAssembler::Tell(const std::function<void(double)>& progress) const {
  if (open_ && head_.lines > 0) {
    progress(static_cast<double>(frame_.height) / static_cast<double>(head_.lines));
  }
}

Result<Page> FrameAssembler::Finish() {
  if (open_ || expects_more_) {
    return Fail("the scanner sent no whole page; scan again", ErrorKind::kMachine);
  }
  return std::move(page_);
}

}  // namespace trammel::machine
