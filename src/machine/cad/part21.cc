#include "machine/cad/part21.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace trammel::machine {
namespace {

constexpr std::string_view kBegin = "ISO-10303-21";
constexpr std::string_view kEnd = "END-ISO-10303-21";

bool IsSpace(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }
bool IsDigit(char c) { return c >= '0' && c <= '9'; }

/// Bytes of the file, from the first to the one behind the last.
struct Range {
  std::size_t begin = 0;
  std::size_t end = 0;
};

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

  [[nodiscard]] Result<std::string> Check() {
    if (!Begins()) return Fail("it is no STEP file: it does not begin with \"ISO-10303-21;\"");
    for (;;) {
      if (!SkipBlanks() || at_ >= text_.size()) return CutShort();
      if (section_ == "REFERENCE" && !text_.substr(at_).starts_with("ENDSEC")) {
        return Fail(
            "parts of it are in other files (its section REFERENCE); export the part into one "
            "file, as AP214");
      }
      auto ended = Statement();
      if (!ended) return tl::unexpected(ended.error());
      if (*ended) break;
    }
    if (!section_.empty() || !begin_of_data_) {
      return Wrong("its end stands where its section DATA is wanted");
    }
    if (auto found = CheckNumbers(); !found) return tl::unexpected(found.error());
    return AsEdition1();
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
      if (!SkipBlanks() || at_ >= text_.size()) return CutShort();
      if (text_[at_] != '=') {
        return Wrong(fmt::format("behind #{} \"=\" is wanted", *number));
      }
      ++at_;
    }
    constexpr int kMostDepth = 64;
    int depth = 0;
    std::array<std::size_t, kMostDepth + 1> entries{};  // of the list at each depth
    while (at_ < text_.size()) {
      const char c = text_[at_];
      if (c == ';' && depth == 0) {
        ++at_;
        return Ended({begin, at_});
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
        if (c == ',' && ++entries[static_cast<std::size_t>(depth)] >= kMostPart21Entries) {
          return TooLong();
        }
        depth += c == '(' ? 1 : c == ')' ? -1 : 0;
        if (depth < 0 || depth > kMostDepth || c == ';') {
          return Wrong("its parentheses do not match");
        }
        if (c == '(') entries[static_cast<std::size_t>(depth)] = 0;
        ++at_;
      }
    }
    return CutShort();
  }

  // True behind the last statement of the file.
  [[nodiscard]] Result<bool> Ended(Range of) {
    std::string_view statement = text_.substr(of.begin, of.end - 1 - of.begin);
    while (!statement.empty() && IsSpace(statement.back())) statement.remove_suffix(1);
    const auto word = statement.substr(0, statement.find_first_of(" \t\r\n(/"));
    if (statement == kEnd) return true;
    if (word == "ENDSEC") {
      EndSection(of);
    } else if (word == "DATA" || word == "HEADER" || word == "ANCHOR" || word == "REFERENCE") {
      if (!section_.empty()) return Wrong("a section begins within another");
      BeginSection(word, of);
    }
    return false;
  }

  void BeginSection(std::string_view word, Range of) {
    section_ = word;
    if (word == "ANCHOR" || word == "REFERENCE") {
      blank_.push_back(of);
    } else if (word == "DATA" && !begin_of_data_) {
      begin_of_data_ = of;
    } else if (word == "DATA") {  // goes on with the first one
      blank_.push_back(of);
      blank_.push_back(end_of_data_);
    }
  }

  void EndSection(Range of) {
    if (section_ == "DATA") end_of_data_ = of;
    if (section_ == "ANCHOR" || section_ == "REFERENCE") blank_.back().end = of.end;
    section_ = {};
  }

  // Line feeds stay, as they separate words and count lines.
  [[nodiscard]] std::string AsEdition1() const {
    std::string plain(text_);
    const auto blank = [&](Range range) {
      std::replace_if(
          plain.begin() + static_cast<std::ptrdiff_t>(range.begin),
          plain.begin() + static_cast<std::ptrdiff_t>(range.end), [](char c) { return c != '\n'; },
          ' ');
    };
    for (const Range& range : blank_) blank(range);
    constexpr std::string_view kData = "DATA;";
    blank(*begin_of_data_);
    return plain.replace(begin_of_data_->begin, kData.size(), kData);
  }

  [[nodiscard]] Result<std::uint32_t> Number() {
    constexpr std::uint64_t kMost = std::numeric_limits<std::int32_t>::max();
    const std::size_t begin = at_;
    std::uint64_t number = 0;
    while (at_ < text_.size() && IsDigit(text_[at_]) && number <= kMost) {
      number = 10 * number + static_cast<std::uint64_t>(text_[at_++] - '0');
    }
    if (at_ == text_.size()) return CutShort();
    if (at_ == begin || number == 0 || number > kMost) {
      return Wrong(fmt::format("\"#\" stands before no number from 1 to {}", kMost));
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
  [[nodiscard]] tl::unexpected<Error> TooLong() const {
    return Fail(fmt::format(
        "a list in line {} has more than {} entries, over which Open CASCADE would work for "
        "minutes; export the part alone, simplified or without its triangles, or an STL",
        Line(), kMostPart21Entries));
  }
  [[nodiscard]] tl::unexpected<Error> CutShort() const {
    return Fail(
        fmt::format("it ends in line {} without \"{};\": it is cut short; export or copy it anew",
                    Line(), kEnd));
  }
  [[nodiscard]] tl::unexpected<Error> Wrong(const std::string& what) const {
    return Fail(fmt::format("in line {} {}: it is damaged; export or copy it anew", Line(), what));
  }

  std::string_view text_;
  std::size_t at_ = 0;
  std::string_view section_;  ///< in which the statement is; empty between two
  std::optional<Range> begin_of_data_;
  Range end_of_data_;
  std::vector<Range> blank_;  ///< that edition 1 does not have
  std::vector<std::uint32_t> defined_;
  std::vector<std::uint32_t> wanted_;
};

}  // namespace

bool LooksLikePart21(std::string_view bytes) { return Scanner(bytes).Begins(); }

Result<std::string> CheckPart21(std::string_view text) { return Scanner(text).Check(); }

}  // namespace trammel::machine
