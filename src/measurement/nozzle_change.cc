#include "measurement/nozzle_change.h"

#include <nlohmann/json.hpp>
#include <optional>
#include <system_error>

#include "files/json_object.h"
#include "files/new_file.h"
#include "measurement/json_lines.h"

namespace trammel::files {

Result<void> NoteNozzleChange(const std::filesystem::path& path, const NozzleChange& change) {
  const nlohmann::ordered_json json = {{"utc", change.utc}, {"printer", change.printer}};
  return AppendLine(path, json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
}

Result<std::string> LastNozzleChange(const std::filesystem::path& path, std::string_view printer,
                                     std::string_view until_utc) {
  std::string last;
  std::error_code ignored;
  if (!std::filesystem::exists(std::filesystem::symlink_status(path, ignored))) return last;
  const auto read = ForEachLine(path, [&](std::optional<std::string_view> line, std::size_t) {
    const auto json = line ? ParseJson(*line, "") : tl::unexpected(Error{});
    if (!json || !json->is_object()) return;
    JsonObject object(*json, "");
    const std::string utc = object.Text("utc");
    const std::string changed = object.Text("printer");
    if (!object.failed() && changed == printer && utc <= until_utc && utc > last) last = utc;
  });
  if (!read) return tl::unexpected(read.error());
  return last;
}

}  // namespace trammel::files
