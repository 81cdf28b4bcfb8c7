// Says which word of a command line no command knows, and which was meant.
#pragma once

#include <optional>
#include <span>
#include <string>

namespace CLI {
class App;
}

namespace trammel::app {

/// Finds the first word that names no command or option, or a command that is missing.
/// @param program  all commands, as they were registered.
/// @param words    of the command line, without the program's own name.
/// @returns a sentence that names the word and what there is; absent where every word is known.
[[nodiscard]] std::optional<std::string> Mistyped(const CLI::App& program,
                                                  std::span<const std::string> words);

}  // namespace trammel::app
