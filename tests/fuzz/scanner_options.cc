// The list of a scanner's options, as scanimage prints it.
#include "machine/scanner/scanner_options.h"

#include "fuzz.h"

TRAMMEL_FUZZ_TARGET(scanner_options)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  machine::ScannerOptions options;
  std::string_view text = fuzz::Text(data, size);
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    options.Add(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  for (const char* name : {"mode", "resolution", "x", "three-pass"}) {
    const machine::ScannerOption* option = options.Find(name);
    if (option == nullptr) continue;
    fuzz::Require(option->Values().size() <= 2 * size + 100, "values come from the text");
    for (const std::string& choice : option->choices) {
      fuzz::Require(option->range || option->Takes(std::string_view(choice)),
                    "an option takes each of its choices");
    }
  }
  return 0;
}
