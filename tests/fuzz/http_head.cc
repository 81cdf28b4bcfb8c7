// The head of an HTTP answer, and a body in chunks.
#include "machine/net/http_head.h"

#include "fuzz.h"
#include "machine/net/multipart.h"

TRAMMEL_FUZZ_TARGET(http_head)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  const auto parts = fuzz::Parts(fuzz::Text(data, size), 2);
  if (const auto head = machine::ParseHttpHead(parts[0]); fuzz::Good(head)) {
    fuzz::Require(head->status >= 100 && head->status <= 999, "a status has three digits");
    for (const auto& [name, value] : head->fields) {
      if (name == "content-type") (void)machine::MultipartBoundary(value);
    }
  }
  machine::ChunkDecoder chunks;
  std::vector<std::uint8_t> body;
  constexpr std::size_t kPiece = 7;  // chunks end anywhere in what a read brings
  std::span<const std::uint8_t> rest(reinterpret_cast<const std::uint8_t*>(parts[1].data()),
                                     parts[1].size());
  while (!rest.empty()) {
    const std::size_t count = std::min(kPiece, rest.size());
    if (!fuzz::Good(chunks.Decode(rest.first(count), body))) break;
    rest = rest.subspan(count);
  }
  fuzz::Require(body.size() <= parts[1].size(), "a body is no longer than what brought it");
  return 0;
}
