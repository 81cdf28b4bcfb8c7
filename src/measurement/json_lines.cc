#include "measurement/json_lines.h"

#include <fstream>
#include <string>
#include <system_error>
#include <vector>

namespace trammel::files {

namespace fs = std::filesystem;

Result<void> ForEachLine(const fs::path& path,
                         const std::function<void(std::string_view line)>& visit) {
  std::error_code code;
  const fs::file_status status = fs::status(path, code);
  if (!fs::exists(status)) return Fail(path.string() + ": there is no such file; check the path");
  if (!fs::is_regular_file(status)) return Fail(path.string() + ": is not an ordinary file");
  std::ifstream file(path, std::ios::binary);
  if (!file) return Fail(path.string() + ": cannot be read");
  std::vector<char> piece(std::size_t{1} << 16);
  std::string line;
  bool too_long = false;
  const auto end_line = [&] {
    if (!too_long && !line.empty()) visit(line);
    line.clear();
    too_long = false;
  };
  do {
    file.read(piece.data(), static_cast<std::streamsize>(piece.size()));
    std::string_view rest(piece.data(), static_cast<std::size_t>(file.gcount()));
    while (!rest.empty()) {
      const std::size_t end = rest.find('\n');
      const std::string_view part = rest.substr(0, end);
      too_long = too_long || line.size() + part.size() > kMostLineBytes;
      if (!too_long) line += part;
      if (end == std::string_view::npos) break;
      end_line();
      rest.remove_prefix(end + 1);
    }
  } while (file);
  if (file.bad()) return Fail(path.string() + ": reading failed");
  end_line();
  return {};
}

}  // namespace trammel::files
