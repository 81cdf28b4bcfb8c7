#include "machine/file_bytes.h"

#include <fmt/format.h>

#include <fstream>
#include <system_error>

namespace trammel::machine {

Result<std::vector<std::uint8_t>> ReadFileBytes(const std::filesystem::path& path,
                                                std::int64_t most_bytes) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) {
    return Fail(error ? error.message() : "it is not a file");
  }
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error) return Fail(error.message());
  if (size > static_cast<std::uintmax_t>(most_bytes)) {
    return Fail(fmt::format("it has {} bytes, more than the {} that are read", size, most_bytes));
  }
  std::ifstream file(path, std::ios::binary);
  std::vector<std::uint8_t> bytes(size);
  file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
  if (!file || static_cast<std::uintmax_t>(file.gcount()) != size) {
    return Fail("it cannot be read; check that it exists and may be read");
  }
  return bytes;
}

}  // namespace trammel::machine
