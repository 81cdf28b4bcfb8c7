// What a service keeps of a printer, and what its jobs say on the way.
#include "fuzz.h"
#include "service/kept_state.h"
#include "session/progress_line.h"

TRAMMEL_FUZZ_TARGET(serve_state)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  const std::string_view text = fuzz::Text(data, size);
  if (const auto progress = procedure::ParseProgressLine(text)) {
    const std::string line = procedure::ProgressLine(*progress);
    fuzz::Require(line.find('\n') == std::string::npos, "progress is one line");
    const auto again = procedure::ParseProgressLine(line);
    fuzz::Require(again && again->text == progress->text && again->done == progress->done,
                  "progress reads back as it was said");
  }
  const auto state = service::ParseKeptState(text, "state");
  if (!fuzz::Good(state)) return 0;
  if (state->run) {
    fuzz::Require(service::IsRunId(state->run->id), "a run has a name that can stand in a path");
    fuzz::Require(state->run->complete(), "no run of an earlier service goes on");
  }
  return 0;
}
