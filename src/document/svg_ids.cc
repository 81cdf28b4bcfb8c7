#include "document/svg_ids.h"

#include <map>
#include <string>

namespace trammel::report {
namespace {

bool IsLetter(char c) { return c >= 'a' && c <= 'z'; }
bool IsNumberPart(char c) { return (c >= '0' && c <= '9') || c == '-'; }

/// Length of `letters[-digits…]` at the start of the text; 0 where it does not end in a number.
std::size_t IdLength(std::string_view text, std::size_t& letters) {
  letters = 0;
  while (letters < text.size() && IsLetter(text[letters])) {
    ++letters;
  }
  std::size_t end = letters;
  while (end < text.size() && IsNumberPart(text[end])) {
    ++end;
  }
  return letters > 0 && end > letters ? end : 0;
}

}  // namespace

std::string RenumberSvgIds(std::string_view svg) {
  constexpr std::string_view kDeclaration = " id=\"";
  constexpr std::string_view kLink = "href=\"#";
  constexpr std::string_view kUrl = "url(#";
  std::map<std::string, std::string, std::less<>> renamed;
  std::string out;
  out.reserve(svg.size());
  std::size_t at = 0;
  while (at < svg.size()) {
    std::string_view mark;
    for (const std::string_view candidate : {kDeclaration, kLink, kUrl}) {
      if (svg.substr(at, candidate.size()) == candidate) {
        mark = candidate;
      }
    }
    if (mark.empty()) {
      out += svg[at++];
      continue;
    }
    out += mark;
    at += mark.size();
    std::size_t letters = 0;
    const std::size_t length = IdLength(svg.substr(at), letters);
    if (length == 0) {
      continue;
    }
    const std::string_view id = svg.substr(at, length);
    const auto [entry, added] = renamed.try_emplace(std::string(id));
    if (added) {
      entry->second = std::string(id.substr(0, letters)) + std::to_string(renamed.size());
    }
    out += entry->second;
    at += length;
  }
  return out;
}

}  // namespace trammel::report
