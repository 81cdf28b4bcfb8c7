#include "base/utf8.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>

namespace trammel {
namespace {

constexpr std::string_view kReplacement = "\xEF\xBF\xBD";

/// Returns the length in bytes of the well-formed sequence at the start of the text; 0 if there is
/// none (The Unicode Standard 15, table 3-7).
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

/// Returns the code point of a well-formed sequence.
std::uint32_t CodePoint(std::string_view sequence) {
  const auto byte = [&](std::size_t i) { return static_cast<std::uint8_t>(sequence[i]); };
  if (sequence.size() == 1) return byte(0);
  const std::uint32_t lead_bits = 0xFFU >> (sequence.size() + 1);
  std::uint32_t code = byte(0) & lead_bits;
  for (std::size_t i = 1; i < sequence.size(); ++i) code = code << 6U | (byte(i) & 0x3FU);
  return code;
}

void Append(std::uint32_t code, std::string& text) {
  const auto tail = [&](int bits) {
    return static_cast<char>(0x80U | ((code >> static_cast<unsigned>(bits)) & 0x3FU));
  };
  if (code < 0x80) {
    text += static_cast<char>(code);
  } else if (code < 0x800) {
    text += {static_cast<char>(0xC0U | (code >> 6U)), tail(0)};
  } else if (code < 0x10000) {
    text += {static_cast<char>(0xE0U | (code >> 12U)), tail(6), tail(0)};
  } else {
    text += {static_cast<char>(0xF0U | (code >> 18U)), tail(12), tail(6), tail(0)};
  }
}

std::string FromUtf16(std::string_view bytes, bool low_first) {
  const auto unit = [&](std::size_t at) {
    const auto byte = [&](std::size_t i) { return static_cast<std::uint8_t>(bytes[at + i]); };
    return static_cast<std::uint32_t>(low_first ? byte(0) | byte(1) << 8U
                                                : byte(1) | byte(0) << 8U);
  };
  const auto within = [](std::uint32_t code, std::uint32_t from) {
    return code >= from && code < from + 0x400;
  };
  std::string text;
  for (std::size_t at = 0; at < bytes.size(); at += 2) {
    std::uint32_t code = at + 1 < bytes.size() ? unit(at) : 0xFFFD;
    if (within(code, 0xD800) && at + 3 < bytes.size() && within(unit(at + 2), 0xDC00)) {
      code = 0x10000 + ((code - 0xD800) << 10U) + (unit(at + 2) - 0xDC00);
      at += 2;
    } else if (within(code, 0xD800) || within(code, 0xDC00)) {
      code = 0xFFFD;
    }
    Append(code, text);
  }
  return text;
}

/// True if a terminal may execute the code, or display it elsewhere.
bool ObeyedByTerminals(std::uint32_t code) {
  const auto within = [&](std::uint32_t lo, std::uint32_t hi) { return code >= lo && code <= hi; };
  if (code == '\n' || code == '\t') return false;
  return code < 0x20 || within(0x7F, 0x9F) || code == 0x61C || within(0x200E, 0x200F) ||
         within(0x2028, 0x202E) || within(0x2066, 0x2069);
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

std::string Utf8OrReplaced(std::string_view text, std::size_t max_bytes) {
  constexpr std::string_view kEllipsis = "…";
  max_bytes = std::max(max_bytes, kEllipsis.size());
  std::string clean = Utf8OrReplaced(text.substr(0, max_bytes));
  if (text.size() <= max_bytes && clean.size() <= max_bytes) return clean;
  clean.erase(std::min(clean.size(), max_bytes - kEllipsis.size()));
  clean.erase(clean.size() - IncompleteUtf8(clean));
  return clean.append(kEllipsis);
}

std::string EscapedForTerminal(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  while (!text.empty()) {
    const std::size_t length = SequenceLength(text);
    const std::string_view sequence = text.substr(0, std::max<std::size_t>(length, 1));
    if (length == 0) {
      out += kReplacement;
    } else if (const std::uint32_t code = CodePoint(sequence); ObeyedByTerminals(code)) {
      out += fmt::format("\\u{:04x}", code);
    } else {
      out += sequence;
    }
    text.remove_prefix(sequence.size());
  }
  return out;
}

std::string Utf8OfFile(std::string bytes) {
  if (bytes.starts_with("\xEF\xBB\xBF")) {
    bytes.erase(0, 3);
  } else if (bytes.starts_with("\xFF\xFE") || bytes.starts_with("\xFE\xFF")) {
    return FromUtf16(std::string_view(bytes).substr(2), bytes.front() == '\xFF');
  }
  return bytes;
}

std::size_t IncompleteUtf8(std::string_view text) {
  constexpr std::size_t kLongest = 4;
  for (std::size_t count = 1; count < kLongest && count <= text.size(); ++count) {
    const auto lead = static_cast<std::uint8_t>(text[text.size() - count]);
    if ((lead & 0xC0U) == 0x80U) continue;  // not the first byte of a character
    const std::size_t wanted = lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : lead >= 0xC0 ? 2 : 1;
    return wanted > count ? count : 0;
  }
  return 0;
}

}  // namespace trammel
