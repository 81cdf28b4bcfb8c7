#include "machine/linuxcnc/linuxcnc_session.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>

#include "base/bounded_json.h"
#include "machine/linuxcnc/linuxcnc_limits.h"
#include "machine/linuxcnc/session_script.h"

namespace trammel::machine {
namespace {

using nlohmann::json;

constexpr int kMostJoints = 16;  // of LinuxCNC
constexpr double kJoin_s =
    20;  // Python starts and loads LinuxCNC's libraries, on a busy computer too

tl::unexpected<Error> Strange(const std::string& said) {
  return Fail(fmt::format("LinuxCNC's helper says \"{}\", which is no answer", Clipped(said)),
              ErrorKind::kMachine);
}

std::string TextOf(const json& value) {
  return value.dump(-1, ' ', false, json::error_handler_t::replace);
}

// The answer to the request of that number; absent for one to an earlier request, which was given
// up.
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

// Reads members of an answer; `sound` is false once one was absent or of another kind.
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

LinuxCncSession::LinuxCncSession(std::unique_ptr<DialogueProcess> helper,
                                 LinuxCncSessionOptions options)
    : helper_(std::move(helper)), options_(std::move(options)) {}

Result<std::unique_ptr<LinuxCncSession>> LinuxCncSession::Join(
    const LinuxCncSessionOptions& options, const std::stop_token& stop) {
  const std::vector<std::string> own = {"/usr/bin/python3", "-I", "-c", kSessionScript};
  const std::vector<std::string>& words = options.helper.empty() ? own : options.helper;
  auto helper = DialogueProcess::Start(words);
  if (!helper) return Fail("to join LinuxCNC: " + helper.error().message, helper.error().kind);
  const auto hello = (*helper)->Hear(kJoin_s, stop);
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
  for (; line; line = helper_->Hear(limit_s, stop)) {
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
  facts.joints = static_cast<int>(std::clamp(members.Number("joints"), 0.0, double(kMostJoints)));
  facts.tool = static_cast<int>(std::clamp(members.Number("tool"), 0.0, 1e6));
  facts.tool_length_mm = members.Number("tool_length") * facts.unit_mm;
  facts.tools = static_cast<int>(std::clamp(members.Number("tools"), 0.0, 1e6));
  const json* homed = members.List("homed");
  const auto low = members.Place("low");
  const auto high = members.Place("high");
  const bool sound = members.sound() && facts.joints > 0 && facts.unit_mm > 0 &&
                     homed->size() >= static_cast<std::size_t>(facts.joints);
  if (!sound) return Strange(TextOf(answer));
  auto state = TRY(ParseState(answer, facts.joints));
  facts.state = std::move(state);
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
  // The helper may be gone and the controller not.
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
