#include "machine/scanner/scanner_options.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>

namespace trammel::machine {
namespace {

constexpr std::size_t kMostOptions = 500;  // real scanners have up to a hundred

struct Parsed {
  double value = 0;
  std::string_view rest;  // behind the number: its unit
};

std::optional<Parsed> NumberOf(std::string_view text) {
  double value = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), value);
  if (read.ec != std::errc() || !std::isfinite(value)) return std::nullopt;
  const auto taken = static_cast<std::size_t>(read.ptr - text.data());
  return Parsed{value, text.substr(taken)};
}

std::string_view Before(std::string_view text, std::string_view mark) {
  return text.substr(0, text.find(mark));
}

/// Takes the values of an option: "Gray|Color", "75|150|600dpi", "0..215.9mm", "yes|no".
void TakeValues(std::string_view values, ScannerOption& option) {
  if (const std::size_t dots = values.find(".."); dots != std::string_view::npos) {
    const auto least = NumberOf(values.substr(0, dots));
    const auto most = NumberOf(values.substr(dots + 2));
    if (least && most) option.range = {least->value, most->value};
    return;
  }
  if (values.find('<') != std::string_view::npos) return;  // <int>, <string>: any
  while (!values.empty()) {
    const std::string_view choice = Before(values, "|");
    values.remove_prefix(std::min(choice.size() + 1, values.size()));
    if (!choice.empty()) option.choices.emplace_back(choice);
  }
  // Of numbers the last one has the unit behind it.
  const bool numbers = std::all_of(option.choices.begin(), option.choices.end(),
                                   [](const auto& choice) { return NumberOf(choice).has_value(); });
  if (!numbers || option.choices.empty()) return;
  std::string& last = option.choices.back();
  last.resize(last.size() - NumberOf(last)->rest.size());
}

}  // namespace

bool ScannerOption::Takes(double value) const {
  if (range) return value >= range->first && value <= range->second;
  constexpr double kSame = 1e-3;
  return choices.empty() || std::any_of(choices.begin(), choices.end(), [&](const auto& choice) {
           const auto number = NumberOf(choice);
           return number && std::abs(number->value - value) < kSame;
         });
}

bool ScannerOption::Takes(std::string_view value) const {
  if (const auto number = NumberOf(value); range && number) return Takes(number->value);
  return choices.empty() || std::find(choices.begin(), choices.end(), value) != choices.end();
}

std::string ScannerOption::Values() const {
  if (range) return fmt::format("{:g} to {:g}", range->first, range->second);
  return fmt::format("{}", fmt::join(choices, ", "));
}

void ScannerOptions::Add(std::string_view line) {
  const std::size_t begin = line.find_first_not_of(' ');
  if (begin == std::string_view::npos || line[begin] != '-') return;
  if (options_.size() == kMostOptions) return;
  line.remove_prefix(begin);
  line.remove_prefix(std::min(line.find_first_not_of('-'), line.size()));
  ScannerOption option;
  option.name = line.substr(0, line.find_first_of(" [="));
  if (option.name.empty()) return;
  line.remove_prefix(option.name.size());
  option.active = line.find("[inactive]") == std::string_view::npos;
  constexpr std::string_view kFlag = "[=(";  // of yes and no
  if (line.starts_with(kFlag)) {
    TakeValues(Before(line.substr(kFlag.size()), ")"), option);
  } else {
    std::string_view values = line.substr(std::min(line.find_first_not_of(' '), line.size()));
    if (!values.starts_with('[')) TakeValues(Before(Before(values, " ["), " (in steps"), option);
  }
  options_.push_back(std::move(option));
}

const ScannerOption* ScannerOptions::Find(std::string_view name) const {
  const auto found = std::find_if(options_.begin(), options_.end(),
                                  [&](const ScannerOption& option) { return option.name == name; });
  return found == options_.end() ? nullptr : &*found;
}

const ScannerOption* ScannerOptions::FindActive(std::string_view name) const {
  const ScannerOption* option = Find(name);
  return option != nullptr && option->active ? option : nullptr;
}

}  // namespace trammel::machine
