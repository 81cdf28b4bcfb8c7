#include "app/provenance.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <ctime>
#include <utility>

namespace trammel::app {

std::string_view ProgramVersion() { return "trammel " TRAMMEL_VERSION; }

std::string UtcNow() { return UtcOf(static_cast<double>(std::time(nullptr))); }

std::string UtcOf(double since_1970_s) {
  constexpr double kYear9999_s = 253402300799;
  if (!(since_1970_s >= 0 && since_1970_s <= kYear9999_s)) return fmt::format("{}", since_1970_s);
  return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}",
                     fmt::gmtime(static_cast<std::time_t>(std::floor(since_1970_s))));
}

measurement::Provenance ProvenanceOf(measurement::Instrument instrument,
                                     std::vector<std::string> sources) {
  return {instrument, std::string(ProgramVersion()), UtcNow(), std::move(sources)};
}

std::string RecordingName(measurement::Instrument instrument) {
  return fmt::format("{}-{:%Y%m%dT%H%M%SZ}", ToString(instrument), fmt::gmtime(std::time(nullptr)));
}

std::string Today() {
  const std::time_t now = std::time(nullptr);
  std::tm local{};
  localtime_r(&now, &local);
  constexpr int kFirstYear = 1900;
  return fmt::format("{:04}-{:02}-{:02}", kFirstYear + local.tm_year, local.tm_mon + 1,
                     local.tm_mday);
}

void PrintWrapped(std::string_view label, const std::string& text, int column, std::FILE* where) {
  fmt::print(where, "{:<{}}{}\n", label, column, text);
}

std::string ShellQuoted(const std::string& word) {
  const bool plain = !word.empty() && std::all_of(word.begin(), word.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || std::string_view("-_./,:@=+").find(char(c)) != std::string::npos;
  });
  if (plain) return word;
  std::string quoted = "'";
  for (const char c : word) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

}  // namespace trammel::app
