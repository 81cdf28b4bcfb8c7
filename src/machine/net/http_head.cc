#include "machine/net/http_head.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "base/utf8.h"

namespace trammel::machine {

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
  if (!good) {
    return Fail("its answer is not HTTP; check the port", ErrorKind::kMachine);
  }
  parsed.reason = Utf8OrReplaced(line.substr(std::min(space + 5, line.size())), kLongestReason);
  parsed.fields = ParseHeaderFields(head.substr(line.size()));
  return parsed;
}

Result<void> ChunkDecoder::Decode(std::span<const std::uint8_t> bytes,
                                  std::vector<std::uint8_t>& out) {
  constexpr std::size_t kLongestLine = 1024;
  constexpr std::size_t kMostBytes = 1'000'000'000;
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
      if (error != std::errc{} || end == line_.data() || left_ > kMostBytes) {
        return Fail("its chunked answer is broken: a chunk without a size", ErrorKind::kMachine);
      }
      state_ = left_ == 0 ? State::kEnded : State::kData;
    }
    line_.clear();
  }
  return {};
}

}  // namespace trammel::machine
