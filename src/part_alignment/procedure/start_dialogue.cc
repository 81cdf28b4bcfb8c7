#include "part_alignment/procedure/start_dialogue.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <optional>
#include <sstream>

#include "base/text.h"

namespace trammel::procedure {
namespace {

Result<std::string> AskOne(const StartQuestion& question, Person& person,
                           const std::function<void(const std::string&)>& say) {
  constexpr double kLook_s = 1;
  constexpr int kMostEmpty = 3;
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
    if (answer.empty() && ++empty == kMostEmpty) {
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

}  // namespace

Result<void> AnswerQuestions(const std::vector<StartQuestion>& questions, Person* person,
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
    auto answer = TRY(AskOne(question, *person, say));
    answers[question.name] = std::move(answer);
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

}  // namespace trammel::procedure
