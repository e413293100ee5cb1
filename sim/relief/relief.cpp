#include "sim/relief/relief.h"

#include <cstddef>
#include <utility>

namespace touchstone::sim {
namespace {

enum class KindIndex : std::size_t {};

template <std::size_t... I>
EnumNames<KindIndex> names_of_kinds(std::index_sequence<I...>) {
  return {{std::variant_alternative_t<I, ReliefKind>::kType, static_cast<KindIndex>(I)}...};
}

EnumNames<KindIndex> enum_names(KindIndex) {
  return names_of_kinds(std::make_index_sequence<std::variant_size_v<ReliefKind>>());
}

template <std::size_t I>
void read_if(KindIndex wanted, YamlReader& in, ReliefKind& kind) {
  if (static_cast<std::size_t>(wanted) == I) fields(in, kind.emplace<I>());
}

template <std::size_t... I>
void read_kind(KindIndex wanted, YamlReader& in, ReliefKind& kind, std::index_sequence<I...>) {
  (read_if<I>(wanted, in, kind), ...);
}

}  // namespace

void fields(YamlReader& in, ReliefSpec& relief) {
  KindIndex type{};
  in.required("type", type);
  read_kind(type, in, relief.kind, std::make_index_sequence<std::variant_size_v<ReliefKind>>());
}

double finest_detail(const ReliefSpec& relief) {
  return std::visit([](const auto& kind) { return finest_detail(kind); }, relief.kind);
}

fem::ReliefMap relief_map(const ReliefSpec& relief) {
  return std::visit([](const auto& kind) { return relief_map(kind); }, relief.kind);
}

bool is_sharp(const ReliefSpec& relief) {
  return std::visit([](const auto& kind) { return kind.kSharp; }, relief.kind);
}

}  // namespace touchstone::sim
