#include "machine/net/http.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <utility>

#include "base/text.h"
#include "base/utf8.h"

namespace trammel::machine {
namespace {

std::string_view WithoutDashes(std::string_view text) {
  return text.substr(std::min(text.find_first_not_of('-'), text.size()));
}

tl::unexpected<Error> Broken(std::string what) {
  return Fail(std::move(what), ErrorKind::kMachine);
}

}  // namespace

std::optional<std::uint64_t> StatedLength(const HeaderFields& fields) {
  const auto field = fields.find("content-length");
  if (field == fields.end()) return std::nullopt;
  const std::string& text = field->second;
  std::uint64_t length = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), length);
  if (error == std::errc::result_out_of_range) return UINT64_MAX;
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return length;
}

HeaderFields ParseHeaderFields(std::string_view lines) {
  HeaderFields fields;
  while (!lines.empty()) {
    const std::size_t end = std::min(lines.find('\n'), lines.size());
    const std::string_view line = lines.substr(0, end);
    lines.remove_prefix(std::min(end + 1, lines.size()));
    const std::size_t colon = line.find(':');
    if (colon == std::string_view::npos) continue;
    std::string name = LowerCase(Trimmed(line.substr(0, colon)));
    const std::string_view value = Trimmed(line.substr(colon + 1));
    std::string& field = fields[name];
    // A server with several authentication methods may send a line for each.
    const bool joins = name == "www-authenticate" && !field.empty();
    if (joins) {
      field += ", ";
      field += value;
    } else {
      field = value;
    }
  }
  return fields;
}

std::optional<std::string> MultipartBoundary(std::string_view content_type) {
  const std::string lower = LowerCase(content_type);
  if (Trimmed(lower).substr(0, 10) != "multipart/") return std::nullopt;
  std::size_t at = lower.find(';');
  while (at != std::string::npos) {
    const std::size_t next = lower.find(';', at + 1);
    const std::size_t equals = lower.find('=', at);
    if (equals < next && Trimmed(std::string_view(lower).substr(at + 1, equals - at - 1)) ==
                             std::string_view("boundary")) {
      // A quoted boundary may contain a semicolon.
      std::string_view value = Trimmed(content_type.substr(equals + 1));
      if (!value.empty() && value.front() == '"') {
        value = value.substr(1, value.find('"', 1) - 1);
      } else {
        value = Trimmed(value.substr(0, value.find(';')));
      }
      return std::string(WithoutDashes(value));
    }
    at = next;
  }
  return std::string();
}

MultipartReader::MultipartReader(std::string boundary, const MultipartLimits& limits)
    : needle_(boundary.empty() ? std::string() : "--" + boundary), limits_(limits) {}

std::string_view MultipartReader::Text() const {
  return {reinterpret_cast<const char*>(buffer_.data()) + begin_, buffer_.size() - begin_};
}

void MultipartReader::Feed(std::span<const std::uint8_t> bytes, double now_s) {
  if (bytes.empty() || state_ == State::kEnded) return;
  constexpr std::size_t kWorthMoving = 64 * 1024;
  if (begin_ == buffer_.size() || (begin_ > kWorthMoving && begin_ > buffer_.size() / 2)) {
    buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(begin_));
    begin_ = 0;
  }
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
  reads_.push_back({consumed_ + Text().size(), now_s});
}

void MultipartReader::Drop(std::size_t count) {
  begin_ += count;
  consumed_ += count;
  searched_ = 0;
  at_line_start_ = true;
  while (reads_.size() > 1 && reads_.front().end <= consumed_) reads_.pop_front();
}

double MultipartReader::ArrivalOf(std::size_t count) const {
  for (const Read& read : reads_) {
    if (read.end >= consumed_ + count) return read.time_s;
  }
  return reads_.empty() ? 0 : reads_.back().time_s;
}

std::optional<MultipartReader::Delimiter> MultipartReader::FindDelimiter(std::size_t from) const {
  const std::string_view text = Text();
  for (std::size_t at = text.find(needle_, from); at != std::string_view::npos;
       at = text.find(needle_, at + 1)) {
    std::size_t line = at;
    while (line > 0 && text[line - 1] == '-') --line;
    if (line > 0 ? text[line - 1] != '\n' : !at_line_start_) continue;
    Delimiter found{line, at + needle_.size()};
    if (found.begin > 0) --found.begin;
    if (found.begin > 0 && text[found.begin - 1] == '\r') --found.begin;
    return found;
  }
  return std::nullopt;
}

/// Skips everything up to and including a boundary's line; false if bytes are missing.
Result<bool> MultipartReader::Seek() {
  if (needle_.empty()) {
    std::size_t line = 0;
    const std::string_view text = Text();
    if (text.substr(0, 2) != "--") {
      line = text.find("\n--");
      line = line == std::string_view::npos ? text.size() : line + 1;
    }
    if (const std::size_t end = text.find('\n', line); end != std::string_view::npos) {
      const std::string_view name = WithoutDashes(Trimmed(text.substr(line, end - line)));
      if (!name.empty()) needle_ = "--" + std::string(name);
    }
  }
  const auto found = needle_.empty() ? std::nullopt : FindDelimiter(0);
  if (!found) {
    const std::size_t keep = needle_.empty() ? Text().size() : needle_.size() + 64;
    if (Text().size() > keep) {
      const std::size_t drop = Text().size() - keep;
      const bool line_ends = Text()[drop - 1] == '\n';
      skipped_ += drop;
      Drop(drop);
      at_line_start_ = line_ends;
    }
    const std::size_t most = first_ ? limits_.preamble_bytes : limits_.body_bytes;
    if (skipped_ + (needle_.empty() ? Text().size() : 0) > most) {
      return Broken(fmt::format("no boundary '{}' within {} bytes", needle_, most));
    }
    return false;
  }
  const std::string_view behind = Text().substr(found->end);
  if (behind.substr(0, 2) == "--") {
    state_ = State::kEnded;
    return true;
  }
  const std::size_t line_end = behind.find('\n');
  if (line_end == std::string_view::npos) {
    if (behind.size() > limits_.header_bytes) {
      return Broken(fmt::format("a boundary's line of more than {} bytes", limits_.header_bytes));
    }
    return false;
  }
  Drop(found->end + line_end + 1);
  skipped_ = 0;
  first_ = false;
  state_ = State::kFields;
  return true;
}

Result<bool> MultipartReader::ReadFields() {
  const std::string_view text = Text();
  std::size_t end = std::string_view::npos;
  std::size_t size = 0;
  if (text.substr(0, 1) == "\n" || text.substr(0, 2) == "\r\n") {
    end = 0;
    size = text[0] == '\n' ? 1 : 2;
  } else {
    for (const std::string_view blank : {"\n\r\n", "\n\n"}) {
      if (const std::size_t at = text.find(blank); at < end) {
        end = at;
        size = blank.size();
      }
    }
  }
  if (std::min(end, text.size()) > limits_.header_bytes) {
    return Broken(fmt::format("the head of a part has more than {} bytes", limits_.header_bytes));
  }
  if (end == std::string_view::npos) return false;
  fields_ = ParseHeaderFields(text.substr(0, end));
  const auto length = StatedLength(fields_);
  if (length && *length > limits_.body_bytes) {
    return Broken(fmt::format("a part announces {} bytes, more than the {} that are read", *length,
                              limits_.body_bytes));
  }
  length_ = length ? std::optional<std::size_t>(*length) : std::nullopt;
  Drop(end + size);
  state_ = State::kBody;
  return true;
}

MultipartPart MultipartReader::Cut(std::size_t body_end) {
  MultipartPart part;
  part.fields = std::exchange(fields_, {});
  part.arrival_s = ArrivalOf(body_end);
  const auto begin = buffer_.begin() + static_cast<std::ptrdiff_t>(begin_);
  part.body.assign(begin, begin + static_cast<std::ptrdiff_t>(body_end));
  Drop(body_end);
  state_ = State::kSeek;
  return part;
}

Result<std::optional<MultipartPart>> MultipartReader::ReadBody() {
  if (length_) {
    if (Text().size() < *length_) return std::nullopt;
    // A length that is too large would include the next part.
    const auto found = FindDelimiter(0);
    return Cut(found && found->end <= *length_ ? found->begin : *length_);
  }
  if (const auto found = FindDelimiter(searched_)) return Cut(found->begin);
  if (Text().size() > limits_.body_bytes) {
    return Broken(
        fmt::format("a part without an end within {} bytes; it states no length and no boundary "
                    "follows",
                    limits_.body_bytes));
  }
  searched_ = Text().size() - std::min(Text().size(), needle_.size());
  return std::nullopt;
}

Result<std::optional<MultipartPart>> MultipartReader::Take() {
  for (;;) {
    if (state_ == State::kEnded) return std::nullopt;
    if (state_ == State::kBody) return ReadBody();
    auto moved = TRY(state_ == State::kSeek ? Seek() : ReadFields());
    if (!moved) return std::nullopt;
  }
}

std::optional<MultipartPart> MultipartReader::TakeRest() {
  if (state_ != State::kBody || Text().empty()) return std::nullopt;
  return Cut(Text().size());
}

Result<HttpHead> ParseHttpHead(std::string_view head) {
  const std::string_view line = head.substr(0, head.find_first_of("\r\n"));
  constexpr std::size_t kLongestReason = 100;
  HttpHead parsed;
  const std::size_t space = line.find(' ');
  bool good = line.substr(0, 5) == "HTTP/" && space != std::string_view::npos;
  if (good) {
    const std::string_view code = line.substr(space + 1, 3);
    const auto [end, error] =
        std::from_chars(code.data(), code.data() + code.size(), parsed.status);
    good = error == std::errc{} && end == code.data() + code.size() && parsed.status >= 100;
  }
  if (!good) return Fail("its answer is not HTTP; check the port", ErrorKind::kMachine);
  parsed.reason = Utf8OrReplaced(line.substr(std::min(space + 5, line.size())), kLongestReason);
  parsed.fields = ParseHeaderFields(head.substr(line.size()));
  return parsed;
}

Result<void> ChunkDecoder::Decode(std::span<const std::uint8_t> bytes,
                                  std::vector<std::uint8_t>& out) {
  constexpr std::size_t kLongestLine = 1024;
  constexpr std::size_t kMaxBytes = 1'000'000'000;
  std::size_t at = 0;
  while (at < bytes.size() && state_ != State::kEnded) {
    if (state_ == State::kData) {
      const std::size_t count = std::min(left_, bytes.size() - at);
      const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(at);
      out.insert(out.end(), begin, begin + static_cast<std::ptrdiff_t>(count));
      at += count;
      left_ -= count;
      if (left_ == 0) state_ = State::kDataEnd;
      continue;
    }
    const char c = static_cast<char>(bytes[at++]);
    if (c != '\n') {
      line_ += c;
      if (line_.size() > kLongestLine) {
        return Fail("its chunked answer is broken", ErrorKind::kMachine);
      }
      continue;
    }
    if (state_ == State::kDataEnd) {
      state_ = State::kSize;
    } else {
      const auto [end, error] =
          std::from_chars(line_.data(), line_.data() + line_.size(), left_, 16);
      if (error != std::errc{} || end == line_.data() || left_ > kMaxBytes) {
        return Fail("its chunked answer is broken: a chunk without a size", ErrorKind::kMachine);
      }
      state_ = left_ == 0 ? State::kEnded : State::kData;
    }
    line_.clear();
  }
  return {};
}

}  // namespace trammel::machine
