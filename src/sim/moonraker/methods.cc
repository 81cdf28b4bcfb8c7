// Methods of the virtual Moonraker's API.
#include <fmt/format.h>

#include <chrono>
#include <cmath>

#include "sim/klipper/status.h"
#include "sim/moonraker/hub.h"

namespace trammel::sim {
namespace {

constexpr double kNoTime = 0;
const char* const kVersion = "v0.10.0-virtual";

/// Returns the clock of file dates, since 1970: the computer's, as for the real one.
double Now_s() {
  const std::chrono::duration<double> now = std::chrono::system_clock::now().time_since_epoch();
  return now.count();
}

Answer Missing(const char* argument) {
  return Answer::Error(400, fmt::format("Missing Argument [{}]", argument));
}

Json Folder(const char* name, const char* path, const char* permissions) {
  return {{"name", name}, {"path", path}, {"permissions", permissions}};
}

Json Roots() {
  return Json::array({Folder("config", "/home/pi/printer_data/config", "rw"),
                      Folder("logs", "/home/pi/printer_data/logs", "r"),
                      Folder("gcodes", "/home/pi/printer_data/gcodes", "rw"),
                      Folder("config_examples", "/home/pi/klipper/config", "r"),
                      Folder("docs", "/home/pi/klipper/docs", "r")});
}

std::string Quoted(const std::string& name) {
  std::string safe;
  for (const char c : name) {
    if (c != '"' && c != '\n' && c != '\r') safe += c;
  }
  return "\"" + safe + "\"";
}

}  // namespace

Result<StatusRequest> ParseStatusRequest(const Json& params) {
  const auto objects = params.find("objects");
  if (objects == params.end()) return Fail("Missing Argument [objects]");
  if (!objects->is_object()) return Fail("Invalid Argument Type [objects]");
  StatusRequest request;
  for (const auto& [name, fields] : objects->items()) {
    if (fields.is_null()) {
      request[name] = std::nullopt;
      continue;
    }
    if (!fields.is_array()) return Fail("Invalid argument");
    std::set<std::string> names;
    for (const Json& field : fields) {
      if (!field.is_string()) return Fail("Invalid argument");
      names.insert(field.get<std::string>());
    }
    request[name] = names;
  }
  return request;
}

Json FileList(const VirtualKlipper& klipper) {
  Json list = Json::array();
  for (const auto& [name, text] : klipper.files()) {
    list.push_back(
        {{"path", name}, {"modified", kNoTime}, {"size", text.size()}, {"permissions", "rw"}});
  }
  return list;
}

static Json ConfigFileList(const VirtualKlipper& klipper) {
  Json list = Json::array();
  for (const auto& [name, file] : klipper.config_files()) {
    list.push_back({{"path", name},
                    {"modified", file.modified_s},
                    {"size", file.data.size()},
                    {"permissions", "rw"}});
  }
  return list;
}

static Answer DeleteFile(VirtualKlipper& klipper, const Json& params) {
  const std::string root = "gcodes/";
  const std::optional<std::string> path = TextOf(params, "path");
  if (!path) return NoData("path");
  if (path->rfind(root, 0) != 0) return Answer::Error(400, "Invalid file path: " + *path);
  const std::string name = path->substr(root.size());
  const std::string& state = klipper.print.state;
  if (klipper.print.filename == name && (state == "printing" || state == "paused")) {
    return Answer::Error(403, "File currently in use");
  }
  if (klipper.files().erase(name) == 0) {
    return Answer::Error(404, "File " + *path + " does not exist");
  }
  return Answer::Ok({{"item",
                      {{"path", name},
                       {"root", "gcodes"},
                       {"modified", kNoTime},
                       {"size", 0},
                       {"permissions", ""}}},
                     {"action", "delete_file"}});
}

Json Hub::ServerInfo() const {
  const KlippyState state = State();
  Json components = {"secrets",    "klippy_connection", "jsonrpc",       "application",
                     "websockets", "file_manager",      "authorization", "klippy_apis",
                     "webcam",     "extensions"};
  if (options_.spoolman) components.push_back("spoolman");
  return {{"klippy_connected", state != KlippyState::kDisconnected},
          {"klippy_state", ToString(state)},
          {"components", components},
          {"failed_components", Json::array()},
          {"registered_directories", {"config", "logs", "gcodes", "config_examples", "docs"}},
          {"warnings", Json::array()},
          {"websocket_count", connections_.size()},
          {"moonraker_version", kVersion},
          {"missing_klippy_requirements", Json::array()},
          {"api_version", {1, 5, 0}},
          {"api_version_string", "1.5.0"}};
}

Json Hub::PrinterInfo() const {
  Json info = {{"hostname", "virtual-printer"},
               {"klipper_path", "/home/pi/klipper"},
               {"python_path", "/usr/bin/python3"},
               {"process_id", 1},
               {"user_id", 0},
               {"group_id", 0},
               {"log_file", "/home/pi/printer_data/logs/klippy.log"},
               {"config_file", "/home/pi/printer_data/config/printer.cfg"},
               {"software_version", "v0.13.0-virtual"},
               {"cpu_info", "virtual"}};
  machine_.With([&](VirtualKlipper& klipper) {
    info["state"] = ToString(klipper.state());
    info["state_message"] = klipper.state_message();
  });
  return info;
}

Json Hub::Webcams() const {
  const int port = options_.camera_port();
  const std::string camera = port == 0 ? "/webcam" : fmt::format("http://127.0.0.1:{}", port);
  return {{"webcams", Json::array({{{"name", "nozzle"},
                                    {"enabled", true},
                                    {"icon", "mdiWebcam"},
                                    {"aspect_ratio", "16:9"},
                                    {"target_fps", options_.webcam_frames_per_s},
                                    {"target_fps_idle", 5},
                                    {"location", "printer"},
                                    {"service", "mjpegstreamer"},
                                    {"stream_url", camera + "/?action=stream"},
                                    {"snapshot_url", camera + "/?action=snapshot"},
                                    {"flip_horizontal", false},
                                    {"flip_vertical", false},
                                    {"rotation", 0},
                                    {"source", "config"},
                                    {"extra_data", Json::object()},
                                    {"uid", "00000000-0000-5000-8000-000000000001"}}})}};
}

bool Hub::CallServer(std::uint64_t number, const std::string& method, const Json& params,
                     const Reply& reply) {
  if (options_.spoolman && options_.spoolman->Call(method, params, reply)) return true;
  const auto found = connections_.find(number);
  if (method == "server.connection.identify" && found != connections_.end()) {
    reply(Identify(found->second, number, params));
  } else if (method == "connection.register_remote_method" && found != connections_.end()) {
    reply(RegisterRemote(found->second, params));
  } else if (method == "connection.send_event" && found != connections_.end()) {
    reply(SendAgentEvent(found->second, number, params));
  } else if (method == "server.extensions.list") {
    reply(Answer::Ok(Agents()));
  } else if (method == "server.extensions.request") {
    AskAgent(params, reply);
  } else if (method == "server.info") {
    reply(Answer::Ok(ServerInfo()));
  } else if (method == "machine.proc_stats") {
    // Sampled once a second; the newest is last.
    reply(Answer::Ok({{"moonraker_stats", Json::array({{{"time", std::floor(Now_s())},
                                                        {"cpu_usage", 1.5},
                                                        {"memory", 30000},
                                                        {"mem_units", "kB"}}})}}));
  } else if (method == "server.webcams.list") {
    reply(Answer::Ok(Webcams()));
  } else if (method == "server.files.roots") {
    reply(Answer::Ok(Roots()));
  } else if (method == "server.files.list") {
    const std::string root = TextOf(params, "root").value_or("gcodes");
    if (root != "gcodes" && root != "config") {
      reply(Answer::Error(400, "Invalid root path: " + root));
      return true;
    }
    Json list;
    machine_.With([&](VirtualKlipper& klipper) {
      list = root == "config" ? ConfigFileList(klipper) : FileList(klipper);
    });
    reply(Answer::Ok(list));
  } else if (method == "server.files.delete_file") {
    machine_.With([&](VirtualKlipper& klipper) { reply(DeleteFile(klipper, params)); });
  } else if (method == "access.get_api_key") {
    // A real server always has a key, whether clients need it or not.
    reply(Answer::Ok(options_.api_key.empty() ? std::string(32, '0') : options_.api_key));
  } else if (method == "access.oneshot_token") {
    reply(Answer::Ok(MakeToken()));
  } else if (method == "server.websocket.id" && found != connections_.end()) {
    reply(Answer::Ok({{"websocket_id", number}}));
  } else {
    return false;
  }
  return true;
}

void Hub::Ask(std::uint64_t number, bool subscribe, const Json& params, const Reply& reply) {
  constexpr std::size_t kMaxQueries = 1000;
  const Result<StatusRequest> objects = ParseStatusRequest(params);
  if (!objects) return reply(Answer::Error(400, objects.error().message));
  if (queries_.size() >= kMaxQueries) return reply(Answer::Error(400, "Too many queries wait"));
  queries_.push_back({number, subscribe, *objects, reply});
}

Answer Hub::AddDump(std::uint64_t connection, const std::string& source, const Json& params,
                    std::size_t next, Json header) {
  constexpr std::size_t kMaxDumps = 100;
  const auto form = params.find("response_template");
  const std::optional<std::string> method =
      form != params.end() && form->is_object() ? TextOf(*form, "method") : std::nullopt;
  if (method && dumps_.size() >= kMaxDumps) return Answer::Error(400, "Too many dumps");
  // Without a method nobody is notified, which is no error.
  const auto found = connections_.find(connection);
  const bool through = found != connections_.end() && found->second.through;
  if (method) dumps_.push_back({source, *method, through ? connection : 0, next});
  return Answer::Ok({{"header", std::move(header)}});
}

Answer Hub::StartDump(std::uint64_t connection, const Json& params) {
  const std::optional<std::string> name = TextOf(params, "name");
  if (!name) return Missing("name");
  if (*name != "toolhead" && *name != "extruder") {
    return Answer::Error(400, fmt::format("The value '{}' is not valid for name", *name));
  }
  return AddDump(
      connection, *name, params, 0,
      {"time", "duration", "start_velocity", "acceleration", "start_position", "direction"});
}

bool Hub::CallPrinter(std::uint64_t number, const std::string& method, const Json& params,
                      const Reply& reply) {
  static const std::map<std::string, const char*> scripts = {
      {"printer.print.pause", "PAUSE"},
      {"printer.print.resume", "RESUME"},
      {"printer.print.cancel", "CANCEL_PRINT"}};
  if (method.rfind("printer.", 0) != 0) return false;
  const auto script = scripts.find(method);
  const KlippyState state = State();
  const bool starts = method == "printer.print.start";
  static const std::set<std::string> others = {"printer.info",
                                               "printer.objects.list",
                                               "printer.objects.query",
                                               "printer.objects.subscribe",
                                               "printer.gcode.script",
                                               "printer.gcode.help",
                                               "printer.emergency_stop",
                                               "printer.restart",
                                               "printer.firmware_restart",
                                               "printer.motion_report.dump_trapq"};
  const bool cell_dump = HasLoadCell() && (method == "printer.load_cell.dump_force" ||
                                           method == "printer.load_cell_probe.dump_taps");
  if (!cell_dump && script == scripts.end() && !starts && others.count(method) == 0) return false;
  if (state == KlippyState::kDisconnected) {
    reply(Answer::Error(503, "Klippy Host not connected"));
  } else if (method == "printer.info") {
    reply(Answer::Ok(PrinterInfo()));
  } else if (method == "printer.objects.list") {
    machine_.With([&](VirtualKlipper& klipper) {
      reply(Answer::Ok({{"objects", ObjectNames(klipper)}}));
    });
  } else if (method == "printer.objects.query" || method == "printer.objects.subscribe") {
    Ask(number, method == "printer.objects.subscribe", params, reply);
  } else if (method == "printer.gcode.help") {
    machine_.With([&](VirtualKlipper& klipper) { reply(Answer::Ok(GcodeHelp(klipper))); });
  } else if (method == "printer.gcode.script") {
    const std::optional<std::string> text = TextOf(params, "script");
    if (text) RunScript(*text, reply);
    if (!text) reply(Missing("script"));
  } else if (script != scripts.end()) {
    bool registered = true;
    machine_.With([&](VirtualKlipper& klipper) { registered = klipper.config().pause_resume; });
    if (registered) RunScript(script->second, reply);
    if (!registered) {
      reply(Answer::Error(400, fmt::format("webhooks: No registered callback for path "
                                           "'pause_resume/{}'",
                                           method.substr(method.rfind('.') + 1))));
    }
  } else if (starts) {
    const std::optional<std::string> name = TextOf(params, "filename");
    if (name) RunScript("SDCARD_PRINT_FILE FILENAME=" + Quoted(*name), reply);
    if (!name) reply(NoData("filename"));
  } else if (method == "printer.emergency_stop") {
    machine_.With([](VirtualKlipper& klipper) { klipper.EmergencyStop(); });
    Pump();  // the notification comes before the answer
    reply(Answer::Ok());
  } else if (method == "printer.motion_report.dump_trapq") {
    reply(StartDump(number, params));
  } else if (cell_dump) {
    reply(StartCellDump(number, method, params));
  } else {
    machine_.With([](VirtualKlipper& klipper) { klipper.Restart(); });
    reply(Answer::Ok());
  }
  return true;
}

}  // namespace trammel::sim
