#include "machine/moonraker/spoolman.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string_view>
#include <utility>

#include "base/utf8.h"
#include "machine/net/json_field.h"

namespace trammel::machine {

using nlohmann::json;

namespace {

constexpr std::size_t kLongestName = 100;
constexpr std::size_t kLongestMessage = 300;

const char* Word(SpoolmanEntity entity) {
  return entity == SpoolmanEntity::kFilament ? "filament" : "spool";
}

std::string Path(SpoolmanEntity entity, int id) {
  return fmt::format("/v1/{}/{}", Word(entity), id);
}

std::optional<int> Id(const json& object, const char* name) {
  constexpr double kMax = 2'000'000'000;
  const auto number = Number(object, name);
  if (!number || *number < 0 || *number > kMax || *number != std::floor(*number)) return {};
  return static_cast<int>(*number);
}

tl::unexpected<Error> Strange(const std::string& path) {
  return Fail(fmt::format("Spoolman's answer to {} has another form than is known: is its version "
                          "a newer one?",
                          path),
              ErrorKind::kMachine);
}

// Returns text without control characters.
std::string Printable(const std::string& text) {
  std::string safe = Utf8OrReplaced(text, kLongestName);
  std::erase_if(safe, [](char c) { return static_cast<unsigned char>(c) < ' ' || c == 0x7F; });
  return safe;
}

std::string NameOf(const json& filament) {
  const std::string vendor = TextOr(ObjectOr(filament, "vendor"), "name", "");
  std::string name = TextOr(filament, "name", "");
  if (name.empty()) name = TextOr(filament, "material", "");
  std::string both = vendor;
  if (!vendor.empty() && !name.empty()) both += ' ';
  return Printable(both + name);
}

// Returns major and minor of "0.26.1"; zeros if malformed.
std::pair<int, int> MajorMinor(const std::string& version) {
  std::pair<int, int> numbers{0, 0};
  const char* const end = version.data() + version.size();
  const auto [dot, error] = std::from_chars(version.data(), end, numbers.first);
  if (error != std::errc() || dot == end || *dot != '.') return {0, 0};
  std::from_chars(dot + 1, end, numbers.second);
  return numbers;
}

}  // namespace

WaitLimit Spoolman::Left() const {
  constexpr double kMin_s = 0.001;  // a limit is above zero
  return {std::max(kMin_s, deadline_s_ - HostNow()), limit_.stop};
}

// Distinguishes a hanging Spoolman from a lost link: the server still answers its own methods.
Error Spoolman::NotAnswered(const char* method, const std::string& path, Error error) {
  constexpr double kAlive_s = 3;
  if (error.kind != ErrorKind::kMachine) return error;
  const WaitLimit limit{std::min(kAlive_s, limit_.time_limit_s), limit_.stop};
  if (!printer_.CallServer("server.spoolman.status", nullptr, limit)) return error;
  const bool reads = std::string_view(method) == "GET";
  return {ErrorKind::kMachine,
          fmt::format("Spoolman does not answer {} {} within the {:g} s for all questions, and "
                      "Moonraker does: look "
                      "whether it hangs, or leave it out{}",
                      method, path, limit_.time_limit_s,
                      reads ? "" : "; what it was told to write may come to be written yet")};
}

Result<json> Spoolman::Ask(const char* method, const std::string& path, std::optional<json> body) {
  json params = {{"request_method", method}, {"path", path}, {"use_v2_response", true}};
  if (body) params["body"] = std::move(*body);
  auto answer = printer_.CallServer("server.spoolman.proxy", std::move(params), Left());
  if (!answer) return tl::unexpected(NotAnswered(method, path, answer.error()));
  const json& error = ObjectOr(*answer, "error");
  was_refused_ = !error.empty();
  if (was_refused_) {
    const int status = static_cast<int>(NumberOr(error, "status_code", 0));
    constexpr int kAway = 503;
    const std::string said = Utf8OrReplaced(TextOr(error, "message", ""), kLongestMessage);
    return Fail(status == kAway
                    ? "Spoolman is away: Moonraker has no connection to it ([spoolman] server in "
                      "moonraker.conf); start it, or leave it out"
                    : fmt::format("Spoolman refuses {} {} ({}): {}", method, path, status, said),
                ErrorKind::kMachine);
  }
  const json* response = Member(*answer, "response");
  if (response == nullptr) return Strange(path);
  return *response;
}

Result<bool> Spoolman::Known() {
  const auto info = TRY(printer_.CallServer("server.info", nullptr, Left()));
  const json* components = Member(info, "components");
  return components != nullptr && components->is_array() &&
         std::find(components->begin(), components->end(), "spoolman") != components->end();
}

Result<std::optional<Spool>> Spoolman::ActiveSpool() {
  const auto known = TRY(Known());
  if (!known) return std::nullopt;
  const auto active = TRY(printer_.CallServer("server.spoolman.get_spool_id", nullptr, Left()));
  const auto id = Id(active, "spool_id");
  if (!id) return std::nullopt;
  const std::string path = Path(SpoolmanEntity::kSpool, *id);
  const auto answer = TRY(Ask("GET", path));
  const json& filament = ObjectOr(answer, "filament");
  const auto filament_id = Id(filament, "id");
  if (!filament_id) return Strange(path);
  return Spool{*id, *filament_id, NameOf(filament), Printable(TextOr(filament, "material", "")),
               BoolOr(answer, "archived", false)};
}

Result<bool> Spoolman::HasField(SpoolmanEntity entity, const ExtraField& field) {
  const std::string path = fmt::format("/v1/field/{}", Word(entity));
  const auto answer = TRY(Ask("GET", path));
  if (!answer.is_array()) return Strange(path);
  for (const json& one : answer) {
    if (TextOr(one, "key", "") != field.key) continue;
    const std::string type = TextOr(one, "field_type", "");
    if (type == field.type) return true;
    return Fail(
        fmt::format("Spoolman's field '{}' of a {} is of the type '{}', and '{}' is "
                    "written there: a type cannot be changed; delete the field in "
                    "Spoolman's settings, which deletes its values, too, or leave Spoolman out",
                    field.key, Word(entity), Printable(type), field.type));
  }
  return false;
}

Result<void> Spoolman::AddField(SpoolmanEntity entity, const ExtraField& field) {
  json body = {{"name", field.name}, {"field_type", field.type}};
  if (!field.unit.empty()) body["unit"] = field.unit;
  TRY(Ask("POST", fmt::format("/v1/field/{}/{}", Word(entity), field.key), std::move(body)));
  return {};
}

Result<json> Spoolman::Extras(SpoolmanEntity entity, int id) {
  const std::string path = Path(entity, id);
  const auto answer = TRY(Ask("GET", path));
  if (Id(answer, "id") != id) return Strange(path);
  const json* extra = Member(answer, "extra");
  if (extra == nullptr || extra->is_null()) return json::object();
  const bool texts = extra->is_object() && std::all_of(extra->begin(), extra->end(),
                                                       [](const json& v) { return v.is_string(); });
  if (!texts) return Strange(path);
  return *extra;
}

Result<std::optional<json>> Spoolman::Extra(SpoolmanEntity entity, int id, const std::string& key) {
  const auto extras = TRY(Extras(entity, id));
  const auto found = extras.find(key);
  if (found == extras.end()) return std::nullopt;
  json value = json::parse(found->get<std::string>(), nullptr, false);
  if (value.is_discarded()) return Strange(fmt::format("'{}'", key));
  return value;
}

Result<bool> Spoolman::LeavesOthersAlone() {
  constexpr std::pair kSince{0, 26};  // spools since 0.22, filaments only since this version
  const auto info = TRY(Ask("GET", "/v1/info"));
  return MajorMinor(TextOr(info, "version", "")) >= kSince;
}

Result<void> Spoolman::SetExtra(SpoolmanEntity entity, int id, const std::string& key,
                                const json& value, std::optional<bool>& written) {
  written = false;
  const auto alone = TRY(LeavesOthersAlone());
  const auto before = TRY(Extras(entity, id));
  json wanted = before;
  wanted[key] = FieldText(value);
  // Sends other fields' values only if they would be lost otherwise: another client may have
  // changed one since it was read, and a value that no longer fits its field makes the server
  // reject all.
  written.reset();
  const auto sent =
      Ask("PATCH", Path(entity, id), json{{"extra", alone ? json{{key, wanted[key]}} : wanted}});
  if (!sent) {
    if (was_refused_) written = false;
    return tl::unexpected(sent.error());
  }
  written = true;
  const auto after = TRY(Extras(entity, id));
  const bool all_there = std::all_of(wanted.items().begin(), wanted.items().end(),
                                     [&](const auto& one) { return after.contains(one.key()); });
  const bool as_wanted = alone ? all_there && after[key] == wanted[key] : after == wanted;
  if (as_wanted) return {};
  return Fail(fmt::format("the fields of {} {} read otherwise in Spoolman than they were written: "
                          "another program wrote there at the same time; look at them",
                          Word(entity), id),
              ErrorKind::kMachine);
}

}  // namespace trammel::machine
