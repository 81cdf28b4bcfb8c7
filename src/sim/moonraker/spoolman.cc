#include "sim/moonraker/spoolman.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstdio>
#include <vector>

namespace trammel::sim {
namespace {

constexpr int kOk = 200, kBad = 400, kNotThere = 404, kWrongForm = 422, kAway = 503;
// Moonraker's message if Spoolman answers without one.
constexpr const char* kNoWords404 = "HTTP 404: Not Found";
constexpr const char* kNoWords405 = "HTTP 405: Method Not Allowed";
constexpr const char* kNoWords422 = "HTTP 422: Unprocessable Content";

// "/v1/spool/7" as {"v1", "spool", "7"}.
std::vector<std::string> Parts(const std::string& path) {
  std::vector<std::string> parts;
  for (std::size_t from = 1; from < path.size();) {
    const std::size_t to = std::min(path.find('/', from), path.size());
    parts.push_back(path.substr(from, to - from));
    from = to + 1;
  }
  return parts;
}

std::optional<int> ParseNumber(const std::string& text) {
  int number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

bool IsKey(const std::string& key) {
  constexpr std::size_t kLongest = 64;
  return !key.empty() && key.size() <= kLongest && std::all_of(key.begin(), key.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_';
  });
}

// Returns why a value does not fit its field, in Spoolman's words; empty if it does.
std::string Misfit(const std::string& type, const Json& value) {
  if (type == "text" && !value.is_string()) return "Value is not a string.";
  if (type == "float" && !value.is_number()) return "Value is not a float.";
  if (type == "integer" && !value.is_number_integer()) return "Value is not an integer.";
  if (type == "boolean" && !value.is_boolean()) return "Value is not a boolean.";
  return "";
}

// True if an entity's other extra fields persist when some of them are changed.
bool LeavesOthers(const std::string& version, const std::string& entity) {
  int major = 0, minor = 0;
  if (std::sscanf(version.c_str(), "%d.%d", &major, &minor) != 2) return false;
  return major > 0 || minor >= (entity == "spool" ? 22 : 26);
}

}  // namespace

int VirtualSpoolman::AddSpool(const std::string& vendor, const std::string& name,
                              const std::string& material) {
  const std::lock_guard lock(mutex_);
  const int number = static_cast<int>(entities_["spool"].size()) + 1;
  Json filament = {{"id", number},         {"registered", "2026-01-01T12:00:00Z"},
                   {"density", 1.24},      {"diameter", 1.75},
                   {"weight", 1000.0},     {"extra", Json::object()},
                   {"color_hex", "1A1A1A"}};
  if (!name.empty()) filament["name"] = name;
  if (!material.empty()) filament["material"] = material;
  if (!vendor.empty()) {
    filament["vendor"] = {{"id", 1},
                          {"registered", "2026-01-01T12:00:00Z"},
                          {"name", vendor},
                          {"extra", Json::object()}};
  }
  entities_["filament"][number] = filament;
  entities_["spool"][number] = {{"id", number},        {"registered", "2026-01-02T12:00:00Z"},
                                {"used_weight", 12.5}, {"used_length", 4190.0},
                                {"archived", false},   {"extra", Json::object()}};
  active_ = number;
  return number;
}

void VirtualSpoolman::Activate(std::optional<int> spool) {
  const std::lock_guard lock(mutex_);
  active_ = spool;
}

void VirtualSpoolman::Archive(int spool) {
  const std::lock_guard lock(mutex_);
  entities_["spool"].at(spool)["archived"] = true;
}

void VirtualSpoolman::SetFault(Fault fault) {
  const std::lock_guard lock(mutex_);
  fault_ = fault;
}

void VirtualSpoolman::SetExtra(const std::string& entity, int id, const std::string& key,
                               const std::string& type, const std::optional<std::string>& value) {
  const std::lock_guard lock(mutex_);
  fields_[entity][key] = {
      {"key", key}, {"entity_type", entity}, {"name", key}, {"order", 0}, {"field_type", type}};
  if (value) entities_[entity].at(id)["extra"][key] = *value;
}

std::optional<std::string> VirtualSpoolman::Extra(const std::string& entity, int id,
                                                  const std::string& key) const {
  const std::lock_guard lock(mutex_);
  const Json& extra = entities_.at(entity).at(id)["extra"];
  const auto found = extra.find(key);
  if (found == extra.end()) return std::nullopt;
  return found->get<std::string>();
}

Json VirtualSpoolman::Show(const std::string& entity, int id) const {
  Json shown = entities_.at(entity).at(id);
  if (entity == "spool") shown["filament"] = entities_.at("filament").at(id);
  return shown;
}

VirtualSpoolman::Response VirtualSpoolman::ServeFields(const std::string& method,
                                                       const std::string& entity,
                                                       const std::string& key, const Json& body) {
  auto& fields = fields_[entity];
  if (method == "POST") {
    const auto type = TextOf(body, "field_type");
    const bool empty_unit = TextOf(body, "unit").value_or("s").empty();
    if (!IsKey(key) || !type || TextOf(body, "name").value_or("").empty() || empty_unit) {
      return {kWrongForm, {{"message", kNoWords422}}};
    }
    const auto found = fields.find(key);
    if (found != fields.end() && found->second["field_type"] != *type) {
      return {kBad, {{"message", "Field type cannot be changed."}}};
    }
    Json field = body;
    field["key"] = key;
    field["entity_type"] = entity;
    fields[key] = field;
  } else if (method != "GET" || !key.empty()) {
    return {kNotThere, {{"message", kNoWords404}}};
  }
  Json list = Json::array();
  for (const auto& [name, field] : fields) list.push_back(field);
  return {kOk, list};
}

VirtualSpoolman::Response VirtualSpoolman::Patch(const std::string& entity, int id,
                                                 const Json& body) {
  const auto extra = body.find("extra");
  if (extra == body.end() || !extra->is_object()) return {kOk, Show(entity, id)};
  for (const auto& [key, value] : extra->items()) {
    const auto field = fields_[entity].find(key);
    if (field == fields_[entity].end()) {
      return {kBad, {{"message", fmt::format("Unknown extra field {}.", key)}}};
    }
    if (!value.is_string()) return {kWrongForm, {{"message", kNoWords422}}};
    const Json parsed = Json::parse(value.get<std::string>(), nullptr, false);
    const std::string misfit = parsed.is_discarded() ? "Value is not valid JSON."
                                                     : Misfit(field->second["field_type"], parsed);
    if (!misfit.empty()) {
      return {kBad, {{"message", fmt::format("Invalid extra field for key {}: {}", key, misfit)}}};
    }
  }
  Json& held = entities_[entity].at(id)["extra"];
  if (fault_ == Fault::kCrossed) held["note"] = "\"theirs\"";
  if (!LeavesOthers(version_, entity)) held = Json::object();
  held.update(*extra);
  if (fault_ == Fault::kMeddled && !extra->empty()) held[extra->begin().key()] = "0.01";
  return {kOk, Show(entity, id)};
}

VirtualSpoolman::Response VirtualSpoolman::Serve(const std::string& method, const std::string& path,
                                                 const Json& body) {
  const std::vector<std::string> parts = Parts(path);
  const auto part = [&](std::size_t i) { return i < parts.size() ? parts[i] : std::string(); };
  if (part(1) == "field" && fields_.count(part(2)) > 0 && parts.size() <= 4) {
    return ServeFields(method, part(2), part(3), body);
  }
  if (method == "GET" && path == "/v1/info") return {kOk, {{"version", version_}}};
  const std::string& entity = part(1);
  const auto id = ParseNumber(part(2));
  if (entities_.count(entity) == 0 || !id || parts.size() != 3) {
    return {kNotThere, {{"message", kNoWords404}}};
  }
  if (entities_[entity].count(*id) == 0) {
    return {kNotThere, {{"message", fmt::format("No {} with ID {} found.", entity, *id)}}};
  }
  if (method == "GET") return {kOk, Show(entity, *id)};
  if (method == "PATCH") return Patch(entity, *id, body);
  return {405, {{"message", kNoWords405}}};
}

bool VirtualSpoolman::Call(const std::string& method, const Json& params, const Reply& reply) {
  Answer answer;
  {
    const std::lock_guard lock(mutex_);
    const Json active = active_ ? Json(*active_) : Json(nullptr);
    if (method == "server.spoolman.get_spool_id") {
      answer = Answer::Ok({{"spool_id", active}});
    } else if (method == "server.spoolman.status") {
      answer = Answer::Ok({{"spoolman_connected", fault_ != Fault::kAway},
                           {"pending_reports", Json::array()},
                           {"spool_id", active}});
    } else if (method != "server.spoolman.proxy") {
      return false;
    } else {
      answer = Proxy(params);
    }
  }
  reply(answer);
  return true;
}

Answer VirtualSpoolman::Proxy(const Json& params) {
  const auto verb = TextOf(params, "request_method"), path = TextOf(params, "path");
  if (!verb) return NoData("request_method");
  if (!path) return NoData("path");
  if (path->rfind("/v1/", 0) != 0) {
    return Answer::Error(400, "Invalid path, must start with the API version, e.g. /v1");
  }
  const Json body = params.value("body", Json());
  if (*verb == "GET" && !body.is_null()) {
    return Answer::Error(400, "GET requests cannot have a body");
  }
  const Response response = fault_ == Fault::kAway
                                ? Response{kAway, {{"message", "Spoolman server not available"}}}
                            : fault_ == Fault::kRubbish ? Response{kOk, {{"id", "seven"}}}
                                                        : Serve(*verb, *path, body);
  const bool failed = response.status != kOk;
  const std::string message = TextOf(response.body, "message").value_or("");
  const auto version2 = params.find("use_v2_response");
  if (version2 == params.end() || *version2 != true) {
    return failed ? Answer::Error(response.status, message) : Answer::Ok(response.body);
  }
  if (!failed) {
    return Answer::Ok(
        {{"response", response.body}, {"response_headers", Json::object()}, {"error", nullptr}});
  }
  return Answer::Ok(
      {{"response", nullptr}, {"error", {{"status_code", response.status}, {"message", message}}}});
}

}  // namespace trammel::sim
