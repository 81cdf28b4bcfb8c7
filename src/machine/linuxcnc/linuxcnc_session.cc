#include "machine/linuxcnc/linuxcnc_session.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string_view>
#include <utility>
#include <vector>

#include "base/bounded_json.h"
#include "base/check.h"
#include "machine/linuxcnc/session_script.h"

namespace trammel::machine {
namespace {

using Eigen::Vector3d;
using nlohmann::json;

// NaN is outside of any range.
bool Within(const Vector3d& mm, const Vector3d& low_mm, const Vector3d& high_mm) {
  return (mm.array() >= low_mm.array()).all() && (mm.array() <= high_mm.array()).all();
}

std::string At(const Vector3d& mm) {
  return fmt::format("X {:.6g} Y {:.6g} Z {:.6g}", mm.x(), mm.y(), mm.z());
}

std::string Text(const LinuxCncTravel& travel) {
  return fmt::format("{} … {} mm", At(travel.low_mm), At(travel.high_mm));
}

constexpr int kMaxJoints = 16;  // LinuxCNC's limit
constexpr double kJoin_s =
    20;  // Python starts and loads LinuxCNC's libraries, on a busy computer too

tl::unexpected<Error> Strange(const std::string& said) {
  return Fail(fmt::format("LinuxCNC's helper says \"{}\", which is no answer", Clipped(said)),
              ErrorKind::kMachine);
}

std::string TextOf(const json& value) {
  return value.dump(-1, ' ', false, json::error_handler_t::replace);
}

// Returns the answer to the request of that number; absent for a late one to an earlier request.
Result<std::optional<json>> Understood(const std::string& line, int id) {
  auto answer = ParseBoundedJson(line, "LinuxCNC's helper");
  if (!answer || !answer->is_object()) return Strange(line);
  const auto number = answer->find("id");
  if (number == answer->end() || !number->is_number_integer()) return Strange(line);
  if (*number != id) return std::optional<json>();
  const auto error = answer->find("error");
  if (error == answer->end()) return std::optional(std::move(*answer));
  if (!error->is_string()) return Strange(line);
  const json kind = answer->value("kind", json());
  const bool unsafe = kind == "taken" || kind == "safety";
  return Fail(Clipped(error->get<std::string>()),
              unsafe ? ErrorKind::kSafety : ErrorKind::kMachine);
}

// Reads members of an answer; `sound` becomes false if one is missing or of another kind.
class Members {
 public:
  explicit Members(const json& object) : object_(object) {}
  [[nodiscard]] bool sound() const { return sound_; }

  bool Flag(const char* name) {
    const json* member = Find(name, json::value_t::boolean);
    return member != nullptr && member->get<bool>();
  }
  std::string Text(const char* name) {
    const json* member = Find(name, json::value_t::string);
    return member != nullptr ? member->get<std::string>() : std::string();
  }
  /// Absent, and not sound, unless it is four finite numbers.
  std::optional<Eigen::Vector4d> Place(const char* name) {
    const json* list = List(name);
    sound_ = sound_ && list->size() == 4;
    Eigen::Vector4d place = Eigen::Vector4d::Zero();
    for (std::size_t i = 0; sound_ && i < 4; ++i) {
      sound_ = (*list)[i].is_number() && std::isfinite((*list)[i].get<double>());
      if (sound_) place[static_cast<Eigen::Index>(i)] = (*list)[i].get<double>();
    }
    return sound_ ? std::optional(place) : std::nullopt;
  }
  const json* List(const char* name) { return Find(name, json::value_t::array); }
  double Number(const char* name) {
    const auto member = object_.find(name);
    const bool given = member != object_.end() && member->is_number();
    sound_ = sound_ && given && std::isfinite(member->get<double>());
    return sound_ ? member->get<double>() : 0;
  }

 private:
  const json* Find(const char* name, json::value_t kind) {
    const auto member = object_.find(name);
    if (member != object_.end() && member->type() == kind) return &*member;
    sound_ = false;
    return nullptr;
  }

  const json& object_;
  bool sound_ = true;
};

}  // namespace

Result<LinuxCncTravel> ParseTravel(const std::string& shown) {
  LinuxCncTravel travel;
  std::istringstream stream(shown);
  std::string word;
  for (int i = 0; i < 6; ++i) {
    stream >> word;
    double& bound_mm = i % 2 == 0 ? travel.low_mm[i / 2] : travel.high_mm[i / 2];
    if (!word.empty() && word.find_first_not_of('#') == std::string::npos) continue;
    std::istringstream number(word);
    double told_mm = 0;
    if (!(number >> told_mm) || !number.eof() || std::isnan(told_mm)) {
      return Fail(fmt::format("LinuxCNC shows the limits of its axes as \"{}\", which cannot be "
                              "read; six numbers were expected",
                              Clipped(shown)),
                  ErrorKind::kMachine);
    }
    bound_mm = std::clamp(told_mm, -kFarthest_mm, kFarthest_mm);
  }
  if (!(travel.low_mm.array() < travel.high_mm.array()).all()) {
    return Fail(fmt::format("LinuxCNC tells the travel {}, which is none; look at MIN_LIMIT and "
                            "MAX_LIMIT in its INI file",
                            Text(travel)),
                ErrorKind::kMachine);
  }
  return travel;
}

Result<void> CheckStatedPlace(const Vector3d& machine_mm, const LinuxCncTravel& travel) {
  const Vector3d beyond_mm = Vector3d::Constant(1);
  if (Within(machine_mm, travel.low_mm - beyond_mm, travel.high_mm + beyond_mm)) return {};
  return Fail(fmt::format("LinuxCNC says that the machine is at {}, where it cannot be: its axes "
                          "reach from {}; this is a fault of the controller or its scales",
                          At(machine_mm), Text(travel)),
              ErrorKind::kMachine);
}

Result<void> CheckTarget(const Vector3d& machine_mm, const LinuxCncTravel& travel) {
  if (Within(machine_mm, travel.low_mm, travel.high_mm)) return {};
  return Fail(fmt::format("{} lies outside the travel of the machine, {}; nothing was moved there",
                          At(machine_mm), Text(travel)),
              ErrorKind::kSafety);
}

int PiecesOf(double way_mm, double piece_mm) {
  TRAMMEL_CHECK(way_mm >= 0 && way_mm <= 4 * kFarthest_mm && piece_mm >= 0.01,
                "way = {} mm, piece = {} mm", way_mm, piece_mm);
  return std::max(1, static_cast<int>(std::ceil(way_mm / piece_mm)));
}

std::string Clipped(const std::string& said) {
  constexpr std::size_t kShown = 200;
  return said.size() <= kShown ? said : said.substr(0, kShown) + " …";
}

LinuxCncSession::LinuxCncSession(std::unique_ptr<DialogueProcess> helper,
                                 LinuxCncSessionOptions options)
    : helper_(std::move(helper)), options_(std::move(options)) {}

Result<std::unique_ptr<LinuxCncSession>> LinuxCncSession::Join(
    const LinuxCncSessionOptions& options, const std::stop_token& stop) {
  const std::vector<std::string> own = {"/usr/bin/python3", "-I", "-c", kSessionScript};
  const std::vector<std::string>& words = options.helper.empty() ? own : options.helper;
  auto helper = DialogueProcess::Start(words);
  if (!helper) return Fail("to join LinuxCNC: " + helper.error().message, helper.error().kind);
  const auto hello = (*helper)->ReadLine(kJoin_s, stop);
  if (!hello) {
    return Fail(fmt::format("to join LinuxCNC: {}: {}", words.front(), hello.error().message),
                hello.error().kind);
  }
  TRY(Understood(*hello, 0));
  return std::unique_ptr<LinuxCncSession>(new LinuxCncSession(std::move(*helper), options));
}

Result<json> LinuxCncSession::Ask(json request, const std::stop_token& stop) {
  request["id"] = ++asked_;
  // Each of a request's few commands may take the helper's own five seconds.
  constexpr double kHelper_s = 35;
  const double limit_s = options_.time_limit_s + kHelper_s;
  auto line = helper_->Ask(TextOf(request), limit_s, stop);
  for (; line; line = helper_->ReadLine(limit_s, stop)) {
    auto answer = TRY(Understood(*line, asked_));
    if (answer) return std::move(*answer);
  }
  return Fail(fmt::format("LinuxCNC's helper, \"{}\": {}", request["do"].get<std::string>(),
                          line.error().message),
              line.error().kind);
}

Result<LinuxCncMotion> LinuxCncSession::Motion(const std::stop_token& stop) {
  const auto answer = TRY(Ask({{"do", "look"}}, stop));
  return ParseMotion(answer);
}

Result<LinuxCncMotion> LinuxCncSession::ParseMotion(const json& answer) {
  Members members(answer);
  LinuxCncMotion motion;
  motion.mode = members.Text("mode");
  motion.idle = members.Flag("idle");
  motion.spindle_stopped = members.Flag("spindle_stopped");
  const auto position = members.Place("position");
  const auto commanded = members.Place("commanded");
  if (!members.sound()) return Strange(TextOf(answer));
  motion.position = *position;
  motion.commanded = *commanded;
  return motion;
}

Result<LinuxCncState> LinuxCncSession::State(int joints, const std::stop_token& stop) {
  const auto answer = TRY(Ask({{"do", "state"}}, stop));
  return ParseState(answer, joints);
}

Result<LinuxCncState> LinuxCncSession::ParseState(const json& answer, int joints) {
  const auto motion = TRY(ParseMotion(answer));
  Members members(answer);
  LinuxCncState state;
  state.estop = members.Flag("estop");
  state.on = members.Flag("on");
  state.metric = members.Flag("metric");
  state.c_axis = members.Flag("c_axis");
  state.feed_override = members.Number("feed_override");
  state.fastest_mm_s = members.Number("fastest_mm_s");
  const json* homed = members.List("homed");
  if (!members.sound()) return Strange(TextOf(answer));
  state.homed = homed->size() >= static_cast<std::size_t>(joints);
  for (int joint = 0; state.homed && joint < joints; ++joint) {
    state.homed = (*homed)[static_cast<std::size_t>(joint)] == 1;
  }
  state.mode = motion.mode;
  state.idle = motion.idle && motion.mode != "AUTO";
  state.spindle_stopped = motion.spindle_stopped;
  state.position_mm = motion.position.head<3>();
  state.c_deg = motion.position[3];
  return state;
}

Result<LinuxCncFacts> LinuxCncSession::Facts(const std::stop_token& stop) {
  const auto answer = TRY(Ask({{"do", "facts"}}, stop));
  Members members(answer);
  LinuxCncFacts facts;
  facts.axes = members.Text("axes");
  facts.unit_mm = members.Number("unit_mm");
  facts.joints = static_cast<int>(std::clamp(members.Number("joints"), 0.0, double(kMaxJoints)));
  facts.tool = static_cast<int>(std::clamp(members.Number("tool"), 0.0, 1e6));
  facts.tool_length_mm = members.Number("tool_length") * facts.unit_mm;
  facts.tools = static_cast<int>(std::clamp(members.Number("tools"), 0.0, 1e6));
  const json* homed = members.List("homed");
  const auto low = members.Place("low");
  const auto high = members.Place("high");
  const bool sound = members.sound() && facts.joints > 0 && facts.unit_mm > 0 &&
                     homed->size() >= static_cast<std::size_t>(facts.joints);
  if (!sound) return Strange(TextOf(answer));
  facts.state = TRY(ParseState(answer, facts.joints));
  for (int joint = 0; joint < facts.joints; ++joint) {
    if ((*homed)[static_cast<std::size_t>(joint)] != 1) facts.not_homed.push_back(joint);
  }
  const auto within = [&](const Eigen::Vector4d& place) -> Eigen::Vector3d {
    return (facts.unit_mm * place.head<3>()).cwiseMax(-kFarthest_mm).cwiseMin(kFarthest_mm);
  };
  facts.travel = {within(*low), within(*high)};
  return facts;
}

Result<void> LinuxCncSession::TakeMdi(const std::stop_token& stop) {
  return Do({{"do", "take"}}, stop);
}
Result<void> LinuxCncSession::Mdi(const std::string& block, const std::stop_token& stop) {
  return Do({{"do", "mdi"}, {"block", block}}, stop);
}
Result<void> LinuxCncSession::Move(const std::string& block, const std::stop_token& stop) {
  return Do({{"do", "mdi"}, {"block", block}, {"move", true}}, stop);
}

Result<void> LinuxCncSession::Abort() {
  auto aborted = Do({{"do", "abort"}}, {});
  if (aborted || aborted.error().kind == ErrorKind::kSafety) return aborted;
  // The helper may be gone while the controller still runs.
  auto again = Join(options_, {});
  if (!again) return aborted;
  helper_ = std::move((*again)->helper_);
  asked_ = 0;
  return Do({{"do", "abort"}, {"orphaned", true}}, {});
}

Result<void> LinuxCncSession::Do(json request, const std::stop_token& stop) {
  TRY(Ask(std::move(request), stop));
  return {};
}

Result<std::string> LinuxCncSession::Interpreted(const std::string& text,
                                                 const std::stop_token& stop) {
  const auto answer = TRY(Ask({{"do", "show"}, {"text", text}}, stop));
  Members members(answer);
  std::string shown = members.Text("shown");
  if (!members.sound()) return Strange(TextOf(answer));
  return shown;
}

}  // namespace trammel::machine
