// The head of an HTTP answer, and its body where that is sent in chunks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "machine/net/multipart.h"

namespace trammel::machine {

struct HttpHead {
  int status = 0;  ///< 100 … 999
  std::string reason;
  HeaderFields fields;
};

/// @param head  up to and without the blank line. Errors (kMachine): not an HTTP answer.
[[nodiscard]] Result<HttpHead> ParseHttpHead(std::string_view head);

/// Takes the frames of "Transfer-Encoding: chunked" away, piece by piece.
class ChunkDecoder {
 public:
  /// Appends the payload of `bytes` to `out`. Errors (kMachine): not a chunk, or one above 1 GB.
  [[nodiscard]] Result<void> Decode(std::span<const std::uint8_t> bytes,
                                    std::vector<std::uint8_t>& out);
  [[nodiscard]] bool ended() const { return state_ == State::kEnded; }

 private:
  enum class State { kSize, kData, kDataEnd, kEnded };
  State state_ = State::kSize;
  std::string line_;
  std::size_t left_ = 0;
};

}  // namespace trammel::machine
