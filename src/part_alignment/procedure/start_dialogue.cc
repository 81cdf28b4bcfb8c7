#include "part_alignment/procedure/start_dialogue.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <sstream>

#include "base/text.h"

namespace trammel::procedure {
namespace {

using machine::LinuxCncFacts;
using machine::LinuxCncState;
using part_alignment::MachineBox;

Result<std::string> AskOne(const StartQuestion& question, Operator& person,
                           const std::function<void(const std::string&)>& say) {
  constexpr double kLook_s = 1;
  constexpr int kMaxEmpty = 3;
  const std::string such_as =
      question.example.empty() ? std::string() : ", such as " + question.example;
  int empty = 0;
  const auto prompt = [&] {
    say(question.text + (question.fallback.empty() ? ": " : " [" + question.fallback + "]: "));
  };
  prompt();
  for (;;) {
    const auto line = TRY(person.LineWithin(kLook_s));
    if (!line) continue;
    std::string answer(Trimmed(*line));
    if (answer.empty()) answer = question.fallback;
    if (answer.empty() && ++empty == kMaxEmpty) {
      return Fail(fmt::format(
          "without an answer nothing can be written; when it is known, run it "
          "again with --{}{}: {}",
          question.name, question.example.empty() ? "" : " " + question.example, question.text));
    }
    const Result<void> does =
        answer.empty() ? Fail("an answer is needed" + such_as) : question.check(answer);
    if (does) return answer;
    say(does.error().message + "\n");
    prompt();
  }
}

constexpr bool kForbids = true;

std::string Text(const MachineBox& box) {
  const auto axis = [&](char name, int i) {
    return fmt::format("{} {:g} … {:g}", name, box.low_mm[i], box.high_mm[i]);
  };
  return fmt::format("{}, {}, {} mm", axis('X', 0), axis('Y', 1), axis('Z', 2));
}

MachineBox TravelOf(const LinuxCncFacts& facts) {
  return {facts.travel.low_mm, facts.travel.high_mm};
}

bool IsBox(const MachineBox& box) { return (box.low_mm.array() < box.high_mm.array()).all(); }

bool Holds(const MachineBox& outer, const MachineBox& inner) {
  constexpr double kRounding_mm = 1e-6;
  return (inner.low_mm.array() >= outer.low_mm.array() - kRounding_mm).all() &&
         (inner.high_mm.array() <= outer.high_mm.array() + kRounding_mm).all();
}

// Reports temporary states that forbid a motion.
void AddState(const LinuxCncFacts& facts, const StartRequest& request,
              std::vector<StartContradiction>& found) {
  const LinuxCncState& state = facts.state;
  if (state.estop) found.push_back({"LinuxCNC is in emergency stop", "release it at the machine"});
  if (!state.estop && !state.on) {
    found.push_back({"LinuxCNC's machine power is off", "switch it on at the machine"});
  }
  if (!facts.not_homed.empty()) {
    found.push_back({fmt::format("joint {} of 0 … {} is not homed",
                                 fmt::join(facts.not_homed, ", "), facts.joints - 1),
                     "home the machine: until then its places mean nothing"});
  }
  if (!state.idle) {
    found.push_back({"LinuxCNC runs a program or a move, or is in AUTO mode",
                     "wait for its end or abort it, and choose MANUAL"});
  }
  if (!state.spindle_stopped) {
    found.push_back({"the spindle turns", "stop it: a camera is to sit in it"});
  }
  if (state.feed_override == 0) {
    found.push_back({"the feed override stands at 0", "turn it up: nothing moves there"});
  }
  constexpr double kOriented_deg = 0.01;
  if (request.c_holds_spindle && state.c_axis && std::abs(state.c_deg) > kOriented_deg) {
    found.push_back({fmt::format("C stands at {:.4f} degrees", state.c_deg),
                     "turn it to 0, where the plan has it"});
  }
  if (facts.tool > 0) {
    found.push_back({fmt::format("tool {} is in the spindle, by the tool table {:g} mm long",
                                 facts.tool, facts.tool_length_mm),
                     "take it out: the camera takes its place (T0 M6 where a changer does it)"});
  }
}

}  // namespace

Result<void> AnswerQuestions(const std::vector<StartQuestion>& questions, Operator* person,
                             const std::function<void(const std::string&)>& say,
                             StartAnswers& answers) {
  std::string missing;
  for (const StartQuestion& question : questions) {
    const auto given = answers.find(question.name);
    if (given != answers.end()) {
      if (auto does = question.check(given->second); !does) {
        return Fail(fmt::format("--{}: {}", question.name, does.error().message));
      }
    } else if (person == nullptr && question.fallback.empty()) {
      missing += fmt::format("\n  --{}: {}", question.name, question.text);
    }
  }
  if (!missing.empty()) {
    return Fail("there is no terminal to ask at: run it in a terminal, or say" + missing);
  }
  for (const StartQuestion& question : questions) {
    if (answers.contains(question.name)) continue;
    if (person == nullptr) {
      answers[question.name] = question.fallback;
      continue;
    }
    answers[question.name] = TRY(AskOne(question, *person, say));
  }
  return {};
}

Result<std::vector<double>> ParseNumbers(const std::string& text, std::size_t count) {
  std::vector<double> numbers;
  const char* at = text.data();
  const char* const end = text.data() + text.size();
  while (numbers.size() < count) {
    double number = 0;
    const auto read = std::from_chars(at, end, number);
    if (read.ec != std::errc() || !std::isfinite(number)) break;
    numbers.push_back(number);
    at = read.ptr;
    if (numbers.size() == count || at == end || *at != ',') break;
    ++at;
  }
  if (numbers.size() == count && at == end) return numbers;
  return Fail(fmt::format("\"{}\" is not {} with commas between them", text.substr(0, 80),
                          count == 1 ? "a number" : fmt::format("{} numbers", count)));
}

Result<std::vector<double>> ParseBoxes(const std::string& text) {
  std::vector<double> all;
  if (text == "none") return all;
  std::istringstream words(text);
  constexpr std::size_t kNumbers = 6;
  for (std::string word; words >> word;) {
    const auto box = ParseNumbers(word, kNumbers);
    if (!box) {
      return Fail(box.error().message + ": a box is the least X,Y,Z and the most X,Y,Z");
    }
    all.insert(all.end(), box->begin(), box->end());
  }
  return all;
}

std::vector<StartContradiction> CheckMachine(const LinuxCncFacts& facts,
                                             const StartRequest& request) {
  std::vector<StartContradiction> found;
  if (!facts.state.metric) {
    found.push_back({facts.unit_mm != 1
                         ? fmt::format("LinuxCNC's own unit is {:g} mm", facts.unit_mm)
                         : std::string("LinuxCNC's own units are not millimetre and degree"),
                     "only metric machines are driven: [TRAJ] LINEAR_UNITS = mm and "
                     "ANGULAR_UNITS = degree in its INI file",
                     kForbids});
  }
  if (request.c_holds_spindle && !(facts.state.c_axis && facts.HasAxis('C'))) {
    found.push_back(
        {fmt::format("LinuxCNC has no axis C among {} that could hold the spindle", facts.axes),
         "orient and lock the spindle by hand, and say --spindle locked", kForbids});
  }
  for (const char axis : {'X', 'Y', 'Z'}) {
    if (facts.HasAxis(axis)) continue;
    found.push_back({fmt::format("LinuxCNC has no axis {} among {}", axis, facts.axes),
                     "the camera is moved along X, Y and Z: another machine is needed", kForbids});
  }
  const MachineBox told = TravelOf(facts);
  if (!IsBox(told)) {
    found.push_back({"LinuxCNC tells the travel " + Text(told) + ", which is none",
                     "look at MIN_LIMIT and MAX_LIMIT of its axes in its INI file", kForbids});
  } else if (!Holds(told, request.travel)) {
    found.push_back({fmt::format("--travel {} reaches beyond LinuxCNC's limits, {}",
                                 Text(request.travel), Text(told)),
                     "stay within them, or leave --travel out", kForbids});
  }
  AddState(facts, request, found);
  return found;
}

std::vector<StartContradiction> CheckRequest(const StartRequest& request) {
  std::vector<StartContradiction> found;
  if (!IsBox(request.travel)) {
    found.push_back({"--travel " + Text(request.travel) + " is no travel",
                     "give the least X,Y,Z, then the most X,Y,Z", kForbids});
  } else if (!(request.safe_z_mm >= request.travel.low_mm.z() &&
               request.safe_z_mm <= request.travel.high_mm.z())) {
    found.push_back({fmt::format("--safe-z {:g} lies outside of the travel, {}", request.safe_z_mm,
                                 Text(request.travel)),
                     "give a machine Z within it at which the spindle may cross everywhere",
                     kForbids});
  }
  return found;
}

TargetIds CheckIds(const std::vector<part_alignment::PartTarget>& targets,
                   const part_alignment::CodeBook& book) {
  TargetIds ids;
  for (const part_alignment::PartTarget& target : targets) {
    const std::size_t last = target.id.find_last_not_of("0123456789");
    const std::string prefix =
        last == std::string::npos ? std::string() : target.id.substr(0, last + 1);
    const std::string number = target.id.substr(prefix.size());
    if (&target == &targets.front()) ids.prefix = prefix;
    constexpr std::size_t kMaxDigits = 6;
    const bool plain = !number.empty() && number.size() <= kMaxDigits && number[0] != '0';
    if (plain && prefix == ids.prefix && std::stoul(number) <= book.words.size()) continue;
    ids.contradictions.push_back(
        {fmt::format("target {} is no code {}1 … {}{} of the {} bits", target.id, ids.prefix,
                     ids.prefix, book.words.size(), book.bits),
         "name the targets by the numbers of their codes, all with the same letters before them, "
         "or say --bits as they were printed",
         kForbids});
  }
  return ids;
}

std::string FactsText(const LinuxCncFacts& facts) {
  const std::string tool =
      facts.tool > 0 ? fmt::format("tool {} in the spindle", facts.tool) : "no tool in the spindle";
  return fmt::format("axes {}, unit {:g} mm, {}, {}, {} in the table", facts.axes, facts.unit_mm,
                     Text(TravelOf(facts)), tool, facts.tools);
}

}  // namespace trammel::procedure
