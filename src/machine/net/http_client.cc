#include "machine/net/http_client.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>
#include <utility>

#include "machine/net/host_clock.h"

namespace trammel::machine {
namespace {

tl::unexpected<Error> Broken(std::string what) {
  return Fail(std::move(what), ErrorKind::kMachine);
}

}  // namespace

Result<HttpAnswer> SendHttp(const Endpoint& endpoint, std::string_view request, double deadline_s,
                            const std::stop_token& stop) {
  constexpr std::size_t kLongestHead = 64 * 1024;
  const auto late = [&] {
    return Broken(fmt::format(
        "no answer to the request within {:g} s; is this {}, and is its network or disk slow?",
        endpoint.time_limit_s, endpoint.server));
  };
  Endpoint bounded = endpoint;
  bounded.time_limit_s = std::min(endpoint.time_limit_s, deadline_s - HostNow());
  if (bounded.time_limit_s <= 0) return late();
  auto stream = TRY(ByteStream::Connect(bounded, stop));
  const auto written = stream.Write(request, deadline_s, stop);
  if (!written && written.error().kind == ErrorKind::kInterrupted) {
    return tl::unexpected(written.error());
  }
  std::vector<std::uint8_t> bytes;
  std::array<std::uint8_t, 4096> buffer{};
  for (;;) {
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    std::size_t end = text.find("\r\n\r\n");
    std::size_t blank = 4;
    if (const std::size_t bare = text.find("\n\n"); bare < end) {
      end = bare;
      blank = 2;
    }
    if (end != std::string_view::npos) {
      auto head = TRY(ParseHttpHead(text.substr(0, end)));
      bytes.erase(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(end + blank));
      return HttpAnswer{std::move(stream), std::move(head), std::move(bytes)};
    }
    if (text.size() > kLongestHead) {
      return Broken(fmt::format("the head of its answer has more than {} bytes", kLongestHead));
    }
    if (text.size() >= 5 && text.substr(0, 5) != "HTTP/") {
      return tl::unexpected(ParseHttpHead(text).error());
    }
    const auto read = stream.Read(buffer, deadline_s, stop);
    if (!read || (read->count == 0 && !read->timed_out)) {
      if (!written) return tl::unexpected(written.error());
      if (!read) return tl::unexpected(read.error());
      return Broken(fmt::format("closed the connection after {} bytes of an answer", bytes.size()));
    }
    if (read->timed_out) return late();
    bytes.insert(bytes.end(), buffer.begin(),
                 buffer.begin() + static_cast<std::ptrdiff_t>(read->count));
  }
}

Result<std::string> ReadHttpBody(HttpAnswer answer, std::size_t max_bytes, double deadline_s,
                                 const std::stop_token& stop) {
  std::optional<std::uint64_t> length = StatedLength(answer.head.fields);
  const auto coding = answer.head.fields.find("transfer-encoding");
  const bool chunked = coding != answer.head.fields.end() && coding->second.starts_with("chunked");
  const auto too_large = [] { return Fail("it sends more than is read of an answer"); };
  if (!chunked && length.value_or(0) > max_bytes) return too_large();
  ChunkDecoder chunks;
  std::vector<std::uint8_t> body;
  std::vector<std::uint8_t> bytes = std::move(answer.rest);
  for (;;) {
    if (chunked) {
      TRY(chunks.Decode(bytes, body));
    } else {
      body.insert(body.end(), bytes.begin(), bytes.end());
    }
    if (body.size() > max_bytes) return too_large();
    if (chunked ? chunks.ended() : length && body.size() >= *length) break;
    bytes.resize(64 * 1024);
    const auto read = TRY(answer.stream.Read(bytes, deadline_s, stop));
    if (read.timed_out) return Broken("its answer does not come whole in time");
    if (read.count == 0) {
      if (chunked || length) return Broken("it breaks off in the middle of its answer");
      break;
    }
    bytes.resize(read.count);
  }
  if (!chunked && length) body.resize(static_cast<std::size_t>(*length));
  return std::string(body.begin(), body.end());
}

}  // namespace trammel::machine
