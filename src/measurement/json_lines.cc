#include "measurement/json_lines.h"

#include <algorithm>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

namespace trammel::files {

namespace fs = std::filesystem;

namespace {

/// Puts lines together of the pieces of a file.
class LineSplitter {
 public:
  LineSplitter(LinesRead from, const std::function<void(const Line&)>& take)
      : done_(from), hash_(from.hash), take_(&take) {}

  void Add(std::string_view rest) {
    while (!rest.empty()) {
      const std::size_t end = rest.find('\n');
      const std::string_view part = rest.substr(0, end);
      too_long_ = too_long_ || line_.size() + part.size() > kMostLineBytes;
      if (!too_long_) line_ += part;
      const std::string_view read = rest.substr(0, end == std::string_view::npos ? end : end + 1);
      hash_ = Fnv1a(read, hash_);
      bytes_ += read.size();
      rest.remove_prefix(read.size());
      if (end != std::string_view::npos) EndLine(true);
    }
  }
  LinesRead Finish() {
    EndLine(false);
    return done_;
  }

 private:
  void EndLine(bool ended) {
    if (too_long_ || !line_.empty()) {
      (*take_)({too_long_ ? std::nullopt : std::optional<std::string_view>(line_), done_.ended + 1,
                ended});
    }
    line_.clear();
    too_long_ = false;
    if (ended) done_ = {done_.bytes + std::exchange(bytes_, 0), done_.ended + 1, hash_};
  }

  LinesRead done_;
  std::uint64_t hash_;     // of all that was added
  std::size_t bytes_ = 0;  // of the line so far
  std::string line_;
  bool too_long_ = false;
  const std::function<void(const Line&)>* take_;
};

}  // namespace

std::uint64_t Fnv1a(std::string_view text, std::uint64_t before) {
  std::uint64_t hash = before;
  for (const unsigned char c : text) hash = (hash ^ c) * 1099511628211U;
  return hash;
}

Result<std::optional<LinesRead>> ForEachLineSince(const fs::path& path, LinesRead from,
                                                  const std::function<void(const Line&)>& take) {
  std::error_code code;
  const fs::file_status status = fs::status(path, code);
  if (!fs::exists(status)) return Fail(path.string() + ": there is no such file; check the path");
  if (!fs::is_regular_file(status)) return Fail(path.string() + ": is not an ordinary file");
  std::ifstream file(path, std::ios::binary);
  if (!file) return Fail(path.string() + ": cannot be read");
  std::vector<char> piece(std::size_t{1} << 16);
  const auto read = [&](std::size_t most) {
    file.read(piece.data(), static_cast<std::streamsize>(std::min(most, piece.size())));
    return std::string_view(piece.data(), static_cast<std::size_t>(file.gcount()));
  };
  std::uint64_t before = kFnv1aOfNothing;
  for (std::size_t left = from.bytes; left > 0;) {
    const std::string_view part = read(left);
    if (part.empty()) break;
    before = Fnv1a(part, before);
    left -= part.size();
  }
  if (file.bad()) return Fail(path.string() + ": reading failed");
  if (!file || before != from.hash) return std::nullopt;  // shorter, or another text
  LineSplitter lines(from, take);
  for (std::string_view part = read(piece.size()); !part.empty(); part = read(piece.size())) {
    lines.Add(part);
  }
  if (file.bad()) return Fail(path.string() + ": reading failed");
  return lines.Finish();
}

Result<void> ForEachLine(const fs::path& path, const TakeLine& take) {
  const auto read =
      ForEachLineSince(path, {}, [&take](const Line& line) { take(line.text, line.number); });
  if (!read) return tl::unexpected(read.error());
  return {};
}

}  // namespace trammel::files
