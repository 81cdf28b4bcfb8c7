// What a printer says while a script runs: the script, then its console, line by line.
#include <set>
#include <string>

#include "fuzz.h"
#include "machine/moonraker/message_log.h"
#include "machine/moonraker/script_watch.h"
#include "machine/moonraker/tap_stream.h"

TRAMMEL_FUZZ_TARGET(script_answers)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  const auto parts = fuzz::Parts(fuzz::Text(data, size), 2);
  machine::MessageLog log(3);
  machine::ScriptWatch watch(std::string(parts[0]), std::set<std::string>{"LASER_ON"});
  std::string_view rest = parts[1];
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    const std::string line(rest.substr(0, end));
    rest.remove_prefix(std::min(end + 1, rest.size()));
    watch.OnResponse(line);
    (void)machine::ProbeResult(line);
    log.Add(machine::MessageDirection::kIn, line);
  }
  (void)watch.Verdict();
  (void)machine::BlamedLine(parts[0], parts[1]);
  fuzz::Require(log.All().size() <= 3 && log.Excerpt(2).size() < 1000, "the log stays short");
  return 0;
}
