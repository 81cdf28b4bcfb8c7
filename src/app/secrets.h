// Secrets come from files and the environment: a command's words can be read by everybody on the
// computer.
#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "session/checks.h"
#include "settings/scan_settings.h"

namespace trammel::app {

/// What an environment variable holds; empty where there is none.
[[nodiscard]] std::string FromEnvironment(const char* name);

/// The first line of a small file. Error: it cannot be read, or is empty.
[[nodiscard]] Result<std::string> SecretFrom(const std::string& file);

/// The camera's address as given on the command line: itself, or for @FILE what stands in the file.
/// Error: it holds a password or a token; names `option` and the remedy.
[[nodiscard]] Result<std::string> CameraAddressOf(const std::string& option,
                                                  const std::string& given);

/// Settles the API key: TRAMMEL_API_KEY before [moonraker] api_key_file before api_key.
/// Errors: two of the settings, a file that cannot be read, a key that is no line of text.
[[nodiscard]] Result<void> SettleApiKey(settings::ScanSettings& settings);

/// The files whose texts are secrets of a run.
/// @param settings_file  its settings' file, which says `in_file`
/// @param key_file  [moonraker] api_key_file; empty: none
/// @param camera  as given on the command line, @FILE where it names one
[[nodiscard]] std::vector<std::string> FilesWithSecrets(const std::string& settings_file,
                                                        const settings::ScanSettings& in_file,
                                                        const std::string& key_file,
                                                        const std::string& camera);

/// Advice where others on this computer may read one of these files.
[[nodiscard]] std::vector<procedure::Check> CheckSecretFiles(const std::vector<std::string>& files);

}  // namespace trammel::app
