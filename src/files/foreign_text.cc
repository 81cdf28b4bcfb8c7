#include "files/foreign_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <optional>
#include <vector>

#include "base/text.h"

namespace trammel::files {
namespace {

using nlohmann::json;

constexpr int kDeepest = 16;

bool IsSpace(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

// Converts a word to a number, if it is one.
json Scalar(std::string_view word) {
  std::string_view digits = word;
  if (!digits.empty() && digits.front() == '+') digits.remove_prefix(1);
  double number = 0;
  const auto read = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  const bool whole = read.ec == std::errc{} && read.ptr == digits.data() + digits.size();
  if (whole && !digits.empty()) return number;
  return json(std::string(word));
}

// Cursor over text that records the first fault.
class Cursor {
 public:
  Cursor(std::string_view text, std::string file) : text_(text), file_(std::move(file)) {}

  [[nodiscard]] bool failed() const { return error_.has_value(); }
  [[nodiscard]] const Error& error() const { return *error_; }
  [[nodiscard]] bool AtEnd() const { return at_ >= text_.size(); }
  [[nodiscard]] char Here() const { return AtEnd() ? '\0' : text_[at_]; }
  [[nodiscard]] std::string_view Rest() const { return text_.substr(std::min(at_, text_.size())); }
  void Skip(std::size_t count) { at_ = std::min(text_.size(), at_ + count); }
  void SkipSpace() {
    while (!AtEnd() && IsSpace(Here())) ++at_;
  }
  // Skips blanks and comments.
  void SkipIdle() {
    SkipSpace();
    while (Here() == '#') {
      while (!AtEnd() && Here() != '\n') ++at_;
      SkipSpace();
    }
  }
  json Fault(const std::string& what) {
    if (!error_) {
      const auto line = 1 + std::count(text_.begin(), text_.begin() + at_, '\n');
      error_ = Error{ErrorKind::kInput, fmt::format("{}:{}: {}", file_, line, what)};
    }
    at_ = text_.size();
    return nullptr;
  }

 private:
  std::string_view text_;
  std::string file_;
  std::size_t at_ = 0;
  std::optional<Error> error_;
};

json Value(Cursor& cursor, int depth);

std::string Quoted(Cursor& cursor) {
  const char quote = cursor.Here();
  cursor.Skip(1);
  std::string text;
  while (!cursor.AtEnd() && cursor.Here() != quote) {
    if (cursor.Here() == '\\') cursor.Skip(1);
    text += cursor.Here();
    cursor.Skip(1);
  }
  if (cursor.AtEnd()) cursor.Fault("a text is not closed by its quote");
  cursor.Skip(1);
  return text;
}

std::string Bare(Cursor& cursor) {
  std::string word;
  constexpr std::string_view kEnds = ",:]})#";
  while (!cursor.AtEnd() && !IsSpace(cursor.Here()) &&
         kEnds.find(cursor.Here()) == std::string_view::npos) {
    word += cursor.Here();
    cursor.Skip(1);
  }
  if (word.empty()) {
    cursor.Fault(cursor.AtEnd() ? "the text ends where a value should stand"
                                : fmt::format("'{}' stands where a value should", cursor.Here()));
  }
  return word;
}

json List(Cursor& cursor, char end, int depth) {
  json list = json::array();
  cursor.Skip(1);
  while (true) {
    cursor.SkipIdle();
    if (cursor.AtEnd()) return cursor.Fault("a list is not closed");
    if (cursor.Here() == end) break;
    list.push_back(Value(cursor, depth + 1));
    cursor.SkipIdle();
    if (cursor.Here() == ',') {
      cursor.Skip(1);
    } else if (cursor.Here() != end) {
      return cursor.Fault("a comma is missing in a list");
    }
  }
  cursor.Skip(1);
  return list;
}

json Object(Cursor& cursor, int depth) {
  json object = json::object();
  cursor.Skip(1);
  while (true) {
    cursor.SkipIdle();
    if (cursor.AtEnd()) return cursor.Fault("a brace is not closed");
    if (cursor.Here() == '}') break;
    const bool quoted = cursor.Here() == '\'' || cursor.Here() == '"';
    const std::string key = quoted ? Quoted(cursor) : Bare(cursor);
    cursor.SkipIdle();
    if (cursor.Here() != ':') return cursor.Fault("a colon is missing behind a key");
    cursor.Skip(1);
    object[key] = Value(cursor, depth + 1);
    cursor.SkipIdle();
    if (cursor.Here() == ',') {
      cursor.Skip(1);
    } else if (cursor.Here() != '}') {
      return cursor.Fault("a comma is missing behind a value");
    }
  }
  cursor.Skip(1);
  return object;
}

json Value(Cursor& cursor, int depth) {
  if (depth > kDeepest) return cursor.Fault(fmt::format("nested more than {} deep", kDeepest));
  cursor.SkipIdle();
  switch (cursor.Here()) {
    case '{':
      return Object(cursor, depth);
    case '[':
      return List(cursor, ']', depth);
    case '(':
      return List(cursor, ')', depth);
    case '\'':
    case '"':
      return json(Quoted(cursor));
    default:
      break;
  }
  if (cursor.Rest().starts_with("b'") || cursor.Rest().starts_with("b\"")) {
    cursor.Skip(1);
    return json(Quoted(cursor));
  }
  return Scalar(Bare(cursor));
}

struct Line {
  std::size_t indent = 0;
  std::string_view text;   ///< without indent and comment
  std::size_t begin = 0;   ///< offset of `text` in the file
  std::size_t number = 0;  ///< from 1
};

std::vector<Line> LinesOf(std::string_view text) {
  std::vector<Line> lines;
  std::size_t begin = 0;
  std::size_t number = 0;
  while (begin < text.size()) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    std::string_view line = text.substr(begin, end - begin);
    ++number;
    if (const std::size_t comment = line.find('#'); comment != std::string_view::npos) {
      line = line.substr(0, comment);
    }
    const std::size_t indent = std::min(line.find_first_not_of(' '), line.size());
    const std::string_view body = Trimmed(line);
    if (!body.empty() && !body.starts_with('%') && body != "---" && body != "...") {
      lines.push_back({indent, body, begin + indent, number});
    }
    begin = end + 1;
  }
  return lines;
}

class Yaml {
 public:
  Yaml(std::string_view text, std::string file)
      : text_(text), file_(std::move(file)), lines_(LinesOf(text)) {}

  Result<json> Parse() {
    if (lines_.empty()) return Fail(fmt::format("{}: is empty", file_));
    json root = Block(lines_[0].indent, 0);
    if (!error_ && at_ < lines_.size()) Fault("is indented less than what stands before it");
    if (error_) return tl::unexpected(*error_);
    return root;
  }

 private:
  json Fault(const std::string& what) {
    const std::size_t number = lines_[std::min(at_, lines_.size() - 1)].number;
    if (!error_) error_ = Error{ErrorKind::kInput, fmt::format("{}:{}: {}", file_, number, what)};
    at_ = lines_.size();
    return nullptr;
  }

  // Parses a value in flow style that begins at `begin` and may span several lines.
  json Flow(std::size_t begin) {
    Cursor cursor(text_.substr(begin), file_);
    json value = Value(cursor, 0);
    if (cursor.failed()) return Fault("a list or a brace is not closed, or not well formed");
    const std::size_t end = text_.size() - cursor.Rest().size();
    while (at_ < lines_.size() && lines_[at_].begin < end) ++at_;
    return value;
  }

  json Items(std::size_t indent) {
    json list = json::array();
    while (at_ < lines_.size() && lines_[at_].indent == indent &&
           lines_[at_].text.starts_with("-")) {
      const std::string_view item = Trimmed(lines_[at_].text.substr(1));
      if (item.empty()) return Fault("an empty item of a list");
      if (item.front() == '[' || item.front() == '{') {
        list.push_back(Flow(static_cast<std::size_t>(item.data() - text_.data())));
      } else {
        list.push_back(Scalar(item));
        ++at_;
      }
    }
    return list;
  }

  json Block(std::size_t indent, int depth) {
    if (depth > kDeepest) return Fault(fmt::format("nested more than {} deep", kDeepest));
    json object = json::object();
    while (at_ < lines_.size() && lines_[at_].indent == indent) {
      const Line line = lines_[at_];
      const std::size_t colon = line.text.find(':');
      if (colon == std::string_view::npos) return Fault("is neither a key nor a value");
      std::string key(Trimmed(line.text.substr(0, colon)));
      std::erase(key, '"');
      std::string_view rest = Trimmed(line.text.substr(colon + 1));
      if (rest.starts_with("!!"))
        rest = Trimmed(rest.substr(std::min(rest.find(' '), rest.size())));
      if (!rest.empty() && (rest.front() == '[' || rest.front() == '{' || rest.front() == '"' ||
                            rest.front() == '\'')) {
        object[key] = Flow(static_cast<std::size_t>(rest.data() - text_.data()));
        continue;
      }
      ++at_;
      if (!rest.empty()) {
        object[key] = Scalar(rest);
      } else if (at_ < lines_.size() && lines_[at_].text.starts_with("- ") &&
                 lines_[at_].indent >= indent) {
        object[key] = Items(lines_[at_].indent);
      } else if (at_ < lines_.size() && lines_[at_].indent > indent) {
        object[key] = Block(lines_[at_].indent, depth + 1);
      } else {
        object[key] = nullptr;
      }
    }
    return object;
  }

  std::string_view text_;
  std::string file_;
  std::vector<Line> lines_;
  std::size_t at_ = 0;
  std::optional<Error> error_;
};

// Skips <?…?>, <!…> and comments.
void SkipProlog(Cursor& cursor) {
  while (true) {
    cursor.SkipSpace();
    const std::string_view rest = cursor.Rest();
    const std::string_view end = rest.starts_with("<!--") ? "-->"
                                 : rest.starts_with("<?") ? "?>"
                                 : rest.starts_with("<!") ? ">"
                                                          : "";
    if (end.empty()) return;
    const std::size_t at = rest.find(end);
    if (at == std::string_view::npos) {
      cursor.Fault("a comment or declaration is not closed");
      return;
    }
    cursor.Skip(at + end.size());
  }
}

json Element(Cursor& cursor, std::string& name, int depth) {
  if (depth > kDeepest) return cursor.Fault(fmt::format("nested more than {} deep", kDeepest));
  const std::string_view rest = cursor.Rest();
  const std::size_t close = rest.find('>');
  if (cursor.Here() != '<' || close == std::string_view::npos) {
    return cursor.Fault("an element <…> should stand here");
  }
  const std::string_view tag = rest.substr(1, close - 1);
  name = std::string(tag.substr(0, tag.find_first_of(" \t\r\n/")));
  cursor.Skip(close + 1);
  if (tag.ends_with('/')) return nullptr;
  SkipProlog(cursor);
  json value = json::object();
  while (cursor.Here() == '<' && !cursor.Rest().starts_with("</")) {
    std::string inner;
    json child = Element(cursor, inner, depth + 1);
    if (cursor.failed()) return nullptr;
    if (!value.contains(inner)) value[inner] = std::move(child);
    SkipProlog(cursor);
  }
  const std::string_view tail = cursor.Rest();
  const std::size_t end = tail.find('<');
  if (end == std::string_view::npos) return cursor.Fault(fmt::format("<{}> is not closed", name));
  if (value.empty()) value = std::string(Trimmed(tail.substr(0, end)));
  cursor.Skip(end);
  const std::string closing = "</" + name;
  if (!cursor.Rest().starts_with(closing) || cursor.Rest().find('>') == std::string_view::npos) {
    return cursor.Fault(fmt::format("<{}> is not closed", name));
  }
  cursor.Skip(cursor.Rest().find('>') + 1);
  return value;
}

}  // namespace

Result<json> ParseLiteral(std::string_view text, const std::string& file) {
  Cursor cursor(text, file);
  json value = Value(cursor, 0);
  cursor.SkipIdle();
  if (!cursor.failed() && !cursor.AtEnd()) cursor.Fault("more stands behind the value");
  if (cursor.failed()) return tl::unexpected(cursor.error());
  return value;
}

Result<json> ParsePlainYaml(std::string_view text, const std::string& file) {
  return Yaml(text, file).Parse();
}

Result<json> ParsePlainXml(std::string_view text, const std::string& file) {
  Cursor cursor(text, file);
  SkipProlog(cursor);
  std::string name;
  json value = Element(cursor, name, 0);
  if (cursor.failed()) return tl::unexpected(cursor.error());
  return value;
}

}  // namespace trammel::files
