// Which pictures would help a survey most.
#pragma once

#include <string>
#include <vector>

#include "part_alignment/survey/survey.h"

namespace trammel::part_alignment {

/// Targets that are known much worse than the others, or seen too seldom to be checked well, by the
/// side from which more pictures see them; nothing where all are alike. REQUIRES verdict good.
[[nodiscard]] std::vector<std::string> AdvisePictures(const Survey& survey);

}  // namespace trammel::part_alignment
