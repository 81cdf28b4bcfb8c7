// Parses HTTP answers incrementally: the head, chunks, and the parts of a multipart stream. Pure;
// the bytes may be hostile.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace trammel::machine {

/// Header fields, names in lower case; the last of repeated fields counts.
using HeaderFields = std::map<std::string, std::string, std::less<>>;

/// Parses "Name: value" lines. Omits lines without a colon.
[[nodiscard]] HeaderFields ParseHeaderFields(std::string_view lines);

/// Returns the number in Content-Length; the maximum if it is too large, absent if there is none.
[[nodiscard]] std::optional<std::uint64_t> StatedLength(const HeaderFields& fields);

/// Returns the boundary of a multipart content type, quoted or not, without leading dashes; empty
/// if it names none; absent if the type is not multipart.
[[nodiscard]] std::optional<std::string> MultipartBoundary(std::string_view content_type);

struct MultipartLimits {
  std::size_t preamble_bytes = 64 * 1024;  ///< before the first boundary
  std::size_t header_bytes = 16 * 1024;    ///< per part
  std::size_t body_bytes = 16'000'000;     ///< per part
};

struct MultipartPart {
  HeaderFields fields;
  std::vector<std::uint8_t> body;
  double arrival_s = 0;  ///< arrival of the body's last bytes
};

/// Tolerates faults of cameras' servers: parts with and without Content-Length, wrong lengths,
/// boundaries with more dashes than announced, an unannounced boundary, bare line feeds, text
/// before the first boundary and between parts.
class MultipartReader {
 public:
  /// @param boundary  as from MultipartBoundary(); empty: taken from the first line that begins
  /// with --.
  MultipartReader(std::string boundary, const MultipartLimits& limits);

  /// Adds bytes. @param now_s  their arrival.
  void Feed(std::span<const std::uint8_t> bytes, double now_s);

  /// Returns the next whole part; absent until more bytes arrive. Errors (kMachine) name the limit
  /// that was exceeded; the stream cannot continue afterwards.
  [[nodiscard]] Result<std::optional<MultipartPart>> Take();

  /// Returns the incomplete part at the stream's end: a body without its end. Absent if none had
  /// begun.
  [[nodiscard]] std::optional<MultipartPart> TakeRest();

  /// True if the closing boundary was read.
  [[nodiscard]] bool ended() const { return state_ == State::kEnded; }

 private:
  enum class State { kSeek, kFields, kBody, kEnded };

  struct Delimiter {
    std::size_t begin = 0;  ///< start of the preceding line break
    std::size_t end = 0;    ///< behind the boundary's last character
  };

  [[nodiscard]] std::string_view Text() const;
  std::optional<Delimiter> FindDelimiter(std::size_t from) const;
  Result<bool> Seek();
  Result<bool> ReadFields();
  Result<std::optional<MultipartPart>> ReadBody();
  MultipartPart Cut(std::size_t body_end);
  void Drop(std::size_t count);
  [[nodiscard]] double ArrivalOf(std::size_t count) const;

  std::string needle_;  ///< "--" and the boundary
  MultipartLimits limits_;
  State state_ = State::kSeek;
  bool first_ = true;
  std::vector<std::uint8_t> buffer_;
  std::size_t begin_ = 0;      ///< start of unconsumed data in buffer_
  std::size_t searched_ = 0;   ///< in Text(): no whole boundary before this offset
  bool at_line_start_ = true;  ///< a boundary may stand at the very beginning of Text()
  std::size_t skipped_ = 0;    ///< bytes passed over while seeking
  std::uint64_t consumed_ = 0;
  struct Read {
    std::uint64_t end = 0;
    double time_s = 0;
  };
  std::deque<Read> reads_;
  HeaderFields fields_;
  std::optional<std::size_t> length_;
};

struct HttpHead {
  int status = 0;  ///< 100 … 999
  std::string reason;
  HeaderFields fields;
};

/// @param head  up to and without the blank line. Errors (kMachine): not an HTTP answer.
[[nodiscard]] Result<HttpHead> ParseHttpHead(std::string_view head);

/// Removes the framing of "Transfer-Encoding: chunked", piece by piece.
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
