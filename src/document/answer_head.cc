#include "document/answer_head.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <sstream>
#include <string_view>
#include <vector>

#include "document/plot.h"

namespace trammel::report {
namespace {

constexpr double kMargin_px = 12;

struct Row {
  std::string text;
  TextStyle style;
};

// Breaks a text at its blanks; a word wider than the picture is reduced later.
std::vector<std::string> Wrapped(const Canvas& canvas, const std::string& text,
                                 const TextStyle& style, double max_px, std::size_t max_lines) {
  std::vector<std::string> lines = {""};
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    const std::string longer = lines.back().empty() ? word : lines.back() + " " + word;
    if (canvas.TextWidth(longer, style) <= max_px || lines.back().empty()) {
      lines.back() = longer;
    } else if (lines.size() < max_lines) {
      lines.push_back(word);
    } else {
      lines.back() += " …";
      break;
    }
  }
  return lines;
}

}  // namespace

Canvas DrawAnswerHead(const AnswerHead& head, double width_px) {
  constexpr double kSpacing = 1.35;
  constexpr std::size_t kMaxReasonLines = 8;
  const bool good = head.verdict == Verdict::kGood;
  const double room_px = width_px - 2 * kMargin_px;
  const Canvas measure(width_px, 1);
  std::vector<Row> rows;
  const auto add = [&](const std::string& text, const TextStyle& style, std::size_t max_lines) {
    for (std::string& line : Wrapped(measure, text, style, room_px, max_lines)) {
      const TextStyle fitted = Fitted(measure, line, style, room_px);
      rows.push_back({std::move(line), fitted});
    }
  };
  add(fmt::format("{}: {}", head.title, VerdictText(head.verdict)),
      {.size_px = 13, .color = good ? kGreen : kVermilion, .bold = true}, 1);
  if (good) {
    add(head.value, {.size_px = 30, .bold = true}, 1);
    add(head.interval, {.size_px = 14}, 1);
  } else {
    add(head.reason, {.size_px = 14}, kMaxReasonLines);
  }
  if (!head.facts.empty()) {
    add(fmt::format("{}", fmt::join(head.facts, " · ")), {.size_px = 12, .color = kMuted}, 3);
  }
  double height_px = kMargin_px;
  for (const Row& row : rows) height_px += kSpacing * row.style.size_px;
  Canvas canvas(width_px, height_px);
  double baseline_px = 4;
  for (const Row& row : rows) {
    baseline_px += kSpacing * row.style.size_px;
    canvas.Text({kMargin_px, baseline_px}, row.text, row.style);
  }
  return canvas;
}

}  // namespace trammel::report
