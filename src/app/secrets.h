// Secrets are read from files and the environment: every user of the computer can read a command
// line.
#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "session/checks.h"
#include "settings/scan_settings.h"

namespace trammel::app {

/// Returns the value of an environment variable; empty if it is not set.
[[nodiscard]] std::string FromEnvironment(const char* name);

/// Returns the first line of a small file. Error: it cannot be read, or is empty.
[[nodiscard]] Result<std::string> SecretFrom(const std::string& file);

/// Returns the camera's address given on the command line; for @FILE, the file's content. Error:
/// the address contains a password or a token; names `option` and the remedy.
[[nodiscard]] Result<std::string> CameraAddressOf(const std::string& option,
                                                  const std::string& given);

/// Chooses the API key: TRAMMEL_API_KEY before [moonraker] api_key_file before api_key.
/// Errors: both settings are given, the file cannot be read, the key is no line of text.
[[nodiscard]] Result<void> SettleApiKey(settings::ScanSettings& settings);

/// Returns the files whose content is a secret of a run.
/// @param settings_file  file of the settings `in_file`
/// @param key_file  [moonraker] api_key_file; empty: none
/// @param camera  as given on the command line, with @FILE for a file
[[nodiscard]] std::vector<std::string> FilesWithSecrets(const std::string& settings_file,
                                                        const settings::ScanSettings& in_file,
                                                        const std::string& key_file,
                                                        const std::string& camera);

/// Returns a warning for each file that other users of this computer may read.
[[nodiscard]] std::vector<procedure::Check> CheckSecretFiles(const std::vector<std::string>& files);

}  // namespace trammel::app
