#include "report/utf8.h"

#include <cstddef>
#include <cstdint>

namespace trammel::report {
namespace {

constexpr std::string_view kReplacement = "\xEF\xBF\xBD";

/// Bytes of the well-formed sequence at the start of the text; 0 where there is none
/// (The Unicode Standard 15, table 3-7).
std::size_t SequenceLength(std::string_view text) {
  const auto byte = [&](std::size_t i) {
    return i < text.size() ? static_cast<std::uint8_t>(text[i]) : std::uint8_t{0};
  };
  const auto within = [&](std::size_t i, int lo, int hi) { return byte(i) >= lo && byte(i) <= hi; };
  const auto tail = [&](std::size_t i) { return within(i, 0x80, 0xBF); };
  if (within(0, 0x00, 0x7F)) {
    return 1;
  }
  if (within(0, 0xC2, 0xDF)) {
    return tail(1) ? 2 : 0;
  }
  if (within(0, 0xE0, 0xEF)) {
    const int lo = byte(0) == 0xE0 ? 0xA0 : 0x80;
    const int hi = byte(0) == 0xED ? 0x9F : 0xBF;
    return within(1, lo, hi) && tail(2) ? 3 : 0;
  }
  if (within(0, 0xF0, 0xF4)) {
    const int lo = byte(0) == 0xF0 ? 0x90 : 0x80;
    const int hi = byte(0) == 0xF4 ? 0x8F : 0xBF;
    return within(1, lo, hi) && tail(2) && tail(3) ? 4 : 0;
  }
  return 0;
}

bool IsControl(char c) {
  const auto byte = static_cast<std::uint8_t>(c);
  return (byte < 0x20 && c != '\n' && c != '\t') || byte == 0x7F;
}

}  // namespace

std::string Utf8OrReplaced(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  while (!text.empty()) {
    const std::size_t length = SequenceLength(text);
    if (length == 0 || (length == 1 && IsControl(text.front()))) {
      out += kReplacement;
      text.remove_prefix(1);
    } else {
      out += text.substr(0, length);
      text.remove_prefix(length);
    }
  }
  return out;
}

}  // namespace trammel::report
