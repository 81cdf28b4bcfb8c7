#include "app/applied_result.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <filesystem>

#include "app/provenance.h"
#include "base/url_secrets.h"
#include "measurement/history.h"
#include "session/dead_run.h"
#include "session/run_journal.h"

namespace trammel::app {

namespace {

using files::Application;
using measurement::Instrument;

Result<std::filesystem::path> AppliedFile() {
  auto folder = files::StateFolder();
  if (!folder) return tl::unexpected(folder.error());
  return *folder / files::kAppliedFile;
}

Result<void> Note(const AppliedValue& applied, Application::Step step,
                  std::optional<double> before) {
  const auto path = AppliedFile();
  if (!path) return tl::unexpected(path.error());
  const Application application{UtcNow(), WithoutSecrets(applied.machine), step, before,
                                applied.value};
  if (applied.result) return files::NoteApplication(*path, *applied.result, application);
  return files::NoteApplication(*path, applied.instrument, "", application);
}

Result<void> OrNothingSet(const Result<void>& noted) {
  if (noted) return {};
  return Fail(fmt::format("nothing was set, as it cannot be noted for trammel history: {}",
                          noted.error().message),
              noted.error().kind);
}

}  // namespace

Result<void> NoteBegun(const AppliedValue& applied, std::optional<double> before) {
  return OrNothingSet(Note(applied, Application::Step::kBegun, before));
}

void NoteApplied(const AppliedValue& applied) {
  if (const auto noted = Note(applied, Application::Step::kApplied, {}); !noted) {
    fmt::print(stderr, "trammel: set, but not noted for trammel history: {}\n",
               noted.error().message);
  }
}

Result<Undoing> LastToUndo(Instrument instrument, const std::string& machine,
                           std::optional<double> now) {
  const auto path = AppliedFile();
  if (!path) return tl::unexpected(path.error());
  const std::string name = procedure::PrinterName(machine);
  auto noted = files::Applications(*path, instrument, [&](const std::string& address) {
    return procedure::PrinterName(address) == name;
  });
  if (!noted) return tl::unexpected(noted.error());
  constexpr double kSame = 0.0001;  // values are sent with four decimals
  const auto in_force = [&](const std::optional<double>& value) {
    return now && value && std::abs(*now - *value) <= kSame;
  };
  while (!noted->empty()) {
    const Application& last = noted->back().application;
    const bool never_set =
        last.step == Application::Step::kBegun && in_force(last.before) && !in_force(last.value);
    if (!never_set) break;
    noted->pop_back();
  }
  if (noted->empty()) {
    return Fail(fmt::format("{} notes no value that was set on {}: name the one to set",
                            path->string(), name));
  }
  const Application& application = noted->back().application;
  if (!application.before) {
    return Fail(fmt::format("what was in force on {} before {} was not told: name the value to set",
                            name, application.utc));
  }
  return Undoing{*application.before, application.value, application.utc,
                 application.step == Application::Step::kUndone, noted->back().fingerprint};
}

Result<void> NoteUndone(Instrument instrument, const std::string& machine, const Undoing& undoing) {
  const auto path = AppliedFile();
  if (!path) return tl::unexpected(path.error());
  return OrNothingSet(
      files::NoteApplication(*path, instrument, undoing.fingerprint,
                             {UtcNow(), WithoutSecrets(machine), Application::Step::kUndone,
                              undoing.before, undoing.value}));
}

}  // namespace trammel::app
