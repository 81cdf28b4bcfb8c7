#include "sim/moonraker/spoolman.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <vector>

namespace trammel::sim {
namespace {

constexpr int kOk = 200, kBad = 400, kNotThere = 404, kWrongForm = 422, kAway = 503;

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

bool Fits(const std::string& type, const Json& value) {
  if (type == "text") return value.is_string();
  if (type == "float") return value.is_number();
  if (type == "integer") return value.is_number_integer();
  if (type == "boolean") return value.is_boolean();
  return false;
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
    if (!IsKey(key) || !type || !TextOf(body, "name")) {
      return {kWrongForm, {{"message", "Validation error"}}};
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
    return {kNotThere, {{"detail", "Not Found"}}};
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
    if (!value.is_string()) return {kWrongForm, {{"message", "Validation error"}}};
    const Json parsed = Json::parse(value.get<std::string>(), nullptr, false);
    if (parsed.is_discarded()) return {kBad, {{"message", "Value is not valid JSON."}}};
    if (!Fits(field->second["field_type"], parsed)) {
      return {kBad, {{"message", "Value is of another type."}}};
    }
  }
  Json& held = entities_[entity].at(id)["extra"];
  held = *extra;  // all of them at once
  if (fault_ == Fault::kMeddled) {
    held["meddled"] = "1";
    fields_[entity]["meddled"] = {{"key", "meddled"}, {"field_type", "float"}};
  }
  return {kOk, Show(entity, id)};
}

VirtualSpoolman::Response VirtualSpoolman::Serve(const std::string& method, const std::string& path,
                                                 const Json& body) {
  const std::vector<std::string> parts = Parts(path);
  const auto part = [&](std::size_t i) { return i < parts.size() ? parts[i] : std::string(); };
  if (part(1) == "field" && fields_.count(part(2)) > 0 && parts.size() <= 4) {
    return ServeFields(method, part(2), part(3), body);
  }
  const std::string& entity = part(1);
  const auto id = ParseNumber(part(2));
  if (entities_.count(entity) == 0 || !id || parts.size() != 3) {
    return {kNotThere, {{"detail", "Not Found"}}};
  }
  if (entities_[entity].count(*id) == 0) {
    return {kNotThere, {{"message", fmt::format("No {} with ID {} found.", entity, *id)}}};
  }
  if (method == "GET") return {kOk, Show(entity, *id)};
  if (method == "PATCH") return Patch(entity, *id, body);
  return {405, {{"detail", "Method Not Allowed"}}};
}

std::optional<Answer> VirtualSpoolman::Call(const std::string& method, const Json& params) {
  const std::lock_guard lock(mutex_);
  const Json active = active_ ? Json(*active_) : Json(nullptr);
  if (method == "server.spoolman.get_spool_id") return Answer::Ok({{"spool_id", active}});
  if (method == "server.spoolman.status") {
    return Answer::Ok({{"spoolman_connected", fault_ != Fault::kAway},
                       {"pending_reports", Json::array()},
                       {"spool_id", active}});
  }
  if (method != "server.spoolman.proxy") return std::nullopt;
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
