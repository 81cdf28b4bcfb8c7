#include "machine/cad/part21.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace trammel::machine {
namespace {

constexpr std::string_view kBegin = "ISO-10303-21";
constexpr std::string_view kEnd = "END-ISO-10303-21";

bool IsSpace(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }
bool IsDigit(char c) { return c >= '0' && c <= '9'; }

class Scanner {
 public:
  explicit Scanner(std::string_view text) : text_(text) {
    if (text_.starts_with("\xEF\xBB\xBF")) at_ = 3;
  }

  // Past blanks and comments; false where a comment does not end.
  bool SkipBlanks() {
    while (at_ < text_.size()) {
      if (IsSpace(text_[at_])) {
        ++at_;
      } else if (text_.substr(at_, 2) == "/*") {
        const std::size_t end = text_.find("*/", at_ + 2);
        if (end == std::string_view::npos) {
          at_ = text_.size();
          return false;
        }
        at_ = end + 2;
      } else {
        return true;
      }
    }
    return true;
  }
  [[nodiscard]] bool Begins() {
    SkipBlanks();
    return text_.substr(at_).starts_with(kBegin);
  }

  [[nodiscard]] Result<void> Check() {
    if (!Begins()) return Fail("it is no STEP file: it does not begin with \"ISO-10303-21;\"");
    for (;;) {
      if (!SkipBlanks() || at_ >= text_.size()) return CutShort();
      auto ended = Statement();
      if (!ended) return tl::unexpected(ended.error());
      if (*ended) break;
    }
    if (within_ || !data_) return Wrong("its end stands where its section DATA is wanted");
    return CheckNumbers();
  }

 private:
  // Up to its semicolon; true behind the last one.
  [[nodiscard]] Result<bool> Statement() {
    const std::size_t begin = at_;
    if (text_[at_] == '#') {
      ++at_;
      const auto number = Number();
      if (!number) return tl::unexpected(number.error());
      defined_.push_back(*number);
      if (!SkipBlanks() || at_ >= text_.size()) return tl::unexpected(CutShort().error());
      if (text_[at_] != '=') {
        return tl::unexpected(Wrong(fmt::format("behind #{} \"=\" is wanted", *number)).error());
      }
      ++at_;
    }
    int depth = 0;
    while (at_ < text_.size()) {
      const char c = text_[at_];
      if (c == ';' && depth == 0) {
        ++at_;
        return Ended(text_.substr(begin, at_ - 1 - begin));
      }
      if (c == '\'' || c == '"') {
        const std::size_t end = text_.find(c, at_ + 1);
        at_ = end == std::string_view::npos ? text_.size() : end + 1;
      } else if (c == '/' && text_.substr(at_, 2) == "/*") {
        if (!SkipBlanks()) break;
      } else if (c == '#') {
        ++at_;
        const auto number = Number();
        if (!number) return tl::unexpected(number.error());
        wanted_.push_back(*number);
      } else {
        constexpr int kMostDepth = 64;
        depth += c == '(' ? 1 : c == ')' ? -1 : 0;
        if (depth < 0 || depth > kMostDepth || c == ';') {
          return tl::unexpected(Wrong("its parentheses do not match").error());
        }
        ++at_;
      }
    }
    return tl::unexpected(CutShort().error());
  }

  [[nodiscard]] Result<bool> Ended(std::string_view statement) {
    while (!statement.empty() && IsSpace(statement.back())) statement.remove_suffix(1);
    const auto section = statement.substr(0, statement.find_first_of(" \t\r\n("));
    if (statement == kEnd) return true;
    if (section == "ENDSEC") {
      within_ = false;
    } else if (section == "DATA" || section == "HEADER") {
      if (within_) return tl::unexpected(Wrong("a section begins within another").error());
      within_ = true;
      data_ = data_ || section == "DATA";
    }
    return false;
  }

  [[nodiscard]] Result<std::uint32_t> Number() {
    constexpr std::uint64_t kMost = std::numeric_limits<std::int32_t>::max();
    const std::size_t begin = at_;
    std::uint64_t number = 0;
    while (at_ < text_.size() && IsDigit(text_[at_]) && number <= kMost) {
      number = 10 * number + static_cast<std::uint64_t>(text_[at_++] - '0');
    }
    if (at_ == text_.size()) return tl::unexpected(CutShort().error());
    if (at_ == begin || number == 0 || number > kMost) {
      return tl::unexpected(
          Wrong(fmt::format("\"#\" stands before no number from 1 to {}", kMost)).error());
    }
    return static_cast<std::uint32_t>(number);
  }

  [[nodiscard]] Result<void> CheckNumbers() {
    std::sort(defined_.begin(), defined_.end());
    const auto twice = std::adjacent_find(defined_.begin(), defined_.end());
    if (twice != defined_.end()) {
      return Fail(fmt::format("#{} is there twice: it is damaged; export or copy it anew", *twice));
    }
    for (const std::uint32_t number : wanted_) {
      if (!std::binary_search(defined_.begin(), defined_.end(), number)) {
        return Fail(fmt::format(
            "it refers to #{}, which is not in it: it is damaged; export or copy it anew", number));
      }
    }
    return {};
  }

  [[nodiscard]] std::ptrdiff_t Line() const {
    const auto end = text_.begin() + static_cast<std::ptrdiff_t>(std::min(at_, text_.size()));
    return 1 + std::count(text_.begin(), end, '\n');
  }
  [[nodiscard]] Result<void> CutShort() const {
    return Fail(
        fmt::format("it ends in line {} without \"{};\": it is cut short; export or copy it anew",
                    Line(), kEnd));
  }
  [[nodiscard]] Result<void> Wrong(const std::string& what) const {
    return Fail(fmt::format("in line {} {}: it is damaged; export or copy it anew", Line(), what));
  }

  std::string_view text_;
  std::size_t at_ = 0;
  bool within_ = false;
  bool data_ = false;
  std::vector<std::uint32_t> defined_;
  std::vector<std::uint32_t> wanted_;
};

}  // namespace

bool LooksLikePart21(std::string_view bytes) { return Scanner(bytes).Begins(); }

Result<void> CheckPart21(std::string_view text) { return Scanner(text).Check(); }

}  // namespace trammel::machine
