#pragma once
// JSON Schemas (draft 07, which yaml-language-server reads) of the YAML files that people write, made from what the
// functions that read these files ask for (core/yaml_form.h). What the reader takes, the schema takes, too, but for
// numbers in quotes; the reader refuses some more: where one value is checked against another, or against a file.

#include <string>
#include <vector>

namespace touchstone::lab {

/// The kinds of files: device, object, motion, scene, job, study, palpation, fit, residual (map).
std::vector<std::string> file_kinds();

/// The schema of one kind, as text. The same bytes each time. @throws Error for a kind that isn't known
std::string file_schema(const std::string& kind);

}  // namespace touchstone::lab
