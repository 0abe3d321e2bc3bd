// SPDX-License-Identifier: Apache-2.0
// A plugin for QEMU that counts instructions between marks: pairs of functions NAME_begin and NAME_end. Its arguments
// are NAME_begin=ADDRESS and NAME_end=ADDRESS, and core=m0plus or core=m4f. For the mark `count` the plugin prints each
// count; for other marks it prints the greatest counts of instructions and of cycles so far, whenever one of them
// rises. The cycles are upper limits. The plugin also prints the targets of each indirect call, each target once.
// Debian's QEMU lacks the header of plugins, so the functions in use are declared here.
#include <bit>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

extern "C" {
using PluginId = std::uint64_t;
struct TranslationBlock;
struct Instruction;
using TranslateCallback = void (*)(PluginId, TranslationBlock*);
using ExecuteCallback = void (*)(unsigned cpu, void* data);
enum CallbackFlags { no_registers = 0 };

void qemu_plugin_register_vcpu_tb_trans_cb(PluginId, TranslateCallback);
std::size_t qemu_plugin_tb_n_insns(const TranslationBlock*);
Instruction* qemu_plugin_tb_get_insn(const TranslationBlock*, std::size_t index);
const void* qemu_plugin_insn_data(const Instruction*);
std::size_t qemu_plugin_insn_size(const Instruction*);
std::uint64_t qemu_plugin_insn_vaddr(const Instruction*);
void qemu_plugin_register_vcpu_insn_exec_cb(Instruction*, ExecuteCallback, CallbackFlags, void* data);

[[gnu::visibility("default")]] extern const int qemu_plugin_version;
const int qemu_plugin_version = 1;
}

namespace {

struct Cost {
  unsigned long long instructions = 0;
  unsigned long long cycles = 0;
};

struct Mark {
  std::string name;
  std::vector<Cost> begins;  // counts at each begin of the mark whose end was not yet reached
  Cost greatest;
};

struct Executed {
  std::uint64_t address;
  unsigned cycles;
  bool calls;  // the instruction calls or jumps to an address in a register
};

bool is_m4f = false;
Cost cost;
const Executed* caller = nullptr;  // last executed instruction if it was an indirect call; otherwise null
std::map<std::string, Mark> marks;
std::map<std::uint64_t, Mark*> begin_addresses, end_addresses;
std::map<std::uint64_t, Executed> executed;
std::set<std::pair<std::uint64_t, std::uint64_t>> calls;

// Returns the cycles of a taken branch. The Cortex-M4 needs 1 to 3 of them to refill its pipeline.
unsigned branch() { return is_m4f ? 4 : 2; }

// Returns the greatest number of cycles that a 16-bit instruction takes, by the tables of ARM's manuals (DDI 0484, DDI
// 0439), for memory without wait states and a multiplier that takes one cycle.
unsigned cycles_of_short(unsigned code) {
  const auto registers = static_cast<unsigned>(std::popcount(code & 0xFF));
  // bit patterns of the instructions that load or store one register
  if (code >> 11 == 0b01001 || (code >= 0x5000 && code < 0xA000)) return 2;
  if (code >> 9 == 0b1011010) return 1 + registers + (code >> 8 & 1);  // bit pattern of the instruction push
  // bit pattern of a pop instruction that returns from the function
  if (code >> 8 == 0b10111101) return (is_m4f ? 5 : 4) + registers;
  // bit patterns of the other pop instructions, and of instructions that load or store several registers
  if (code >> 8 == 0b10111100 || code >> 12 == 0b1100) return 1 + registers;
  if (code >> 12 == 0b1101 || code >> 11 == 0b11100) return branch();  // bit patterns of the instruction b (branch)
  if (code >> 8 == 0b01000111) return branch();                        // bit pattern of the instructions bx and blx
  // bit patterns of the instructions that write the program counter
  if ((code >> 8 == 0b01000110 || code >> 8 == 0b01000100) && (code & 0x87) == 0x87) return branch();
  // bit pattern of the instructions cbz and cbnz
  if (code >> 12 == 0b1011 && (code >> 8 & 0b0101) == 0b0001) return branch();
  return 1;
}

unsigned cycles_of_long(unsigned first, unsigned second) {
  const auto registers = static_cast<unsigned>(std::popcount(second & 0xFFFF));
  // bit pattern of the instructions b and bl; it includes barriers and mrs, which take 3 cycles
  if (first >> 11 == 0b11110 && (second >> 15) != 0) return is_m4f ? 4 : 3;
  // bit patterns of the instructions that load or store several registers
  if (first >> 6 == 0b1110100010 || first >> 6 == 0b1110100100) {
    return 1 + registers + ((second >> 15) != 0 ? 3 : 0);
  }
  // bit pattern of tbb, tbh and the instructions that load or store two registers
  if (first >> 9 == 0b1110100) return (first & 0xFFF0) == 0xE8D0 ? 6 : 3;
  // bit pattern of the instructions that load a register (perhaps the program counter) or store one
  if (first >> 9 == 0b1111100) return second >> 12 == 15 && (first & 0x10) != 0 ? 5 : 2;
  if (first >> 4 == 0xFB9 || first >> 4 == 0xFBB) return 12;  // bit patterns of the division instructions
  // bit pattern of the load and store instructions of the FPU
  if (first >> 9 == 0b1110110) return 1 + (second & 0xFF);
  if (first >> 8 == 0b11101110) return 14;  // bit pattern of the arithmetic instructions of the FPU
  // bit pattern of the multiplications with a result of 64 bits
  return first >> 5 == 0b11111011101 ? 2 : 1;
}

void execute(unsigned, void* data) {
  const auto& one = *static_cast<const Executed*>(data);
  if (caller != nullptr && calls.emplace(caller->address, one.address).second) {
    std::printf("call %llx %llx\n", static_cast<unsigned long long>(caller->address),
                static_cast<unsigned long long>(one.address));
    std::fflush(stdout);
  }
  caller = one.calls ? &one : nullptr;
  ++cost.instructions;
  cost.cycles += one.cycles;
}

void begin(unsigned, void* data) {
  Mark& mark = *static_cast<Mark*>(data);
  if (mark.name != "count") mark.begins.clear();
  mark.begins.push_back(cost);
}

void end(unsigned, void* data) {
  Mark& mark = *static_cast<Mark*>(data);
  if (mark.begins.empty()) return;
  const Cost since{cost.instructions - mark.begins.back().instructions, cost.cycles - mark.begins.back().cycles};
  mark.begins.pop_back();
  if (mark.name == "count") {
    std::printf("count %zu %llu\n", mark.begins.size(), since.instructions);
  } else if (since.instructions > mark.greatest.instructions || since.cycles > mark.greatest.cycles) {
    if (since.instructions > mark.greatest.instructions) mark.greatest.instructions = since.instructions;
    if (since.cycles > mark.greatest.cycles) mark.greatest.cycles = since.cycles;
    std::printf("%s %llu %llu\n", mark.name.c_str(), mark.greatest.instructions, mark.greatest.cycles);
  }
  std::fflush(stdout);
}

void translate(Instruction* instruction) {
  const std::uint64_t address = qemu_plugin_insn_vaddr(instruction);
  if (const auto found = begin_addresses.find(address); found != begin_addresses.end()) {
    return qemu_plugin_register_vcpu_insn_exec_cb(instruction, begin, no_registers, found->second);
  }
  if (const auto found = end_addresses.find(address); found != end_addresses.end()) {
    return qemu_plugin_register_vcpu_insn_exec_cb(instruction, end, no_registers, found->second);
  }
  std::uint16_t code[2]{};
  std::memcpy(code, qemu_plugin_insn_data(instruction), qemu_plugin_insn_size(instruction));
  const bool is_long = qemu_plugin_insn_size(instruction) == 4;
  // the instruction is bx or blx, and its target is not in the link register
  const bool calls_register = !is_long && code[0] >> 8 == 0x47 && (code[0] >> 3 & 15) != 14;
  Executed& one = executed[address];
  one = {address, is_long ? cycles_of_long(code[0], code[1]) : cycles_of_short(code[0]), calls_register};
  qemu_plugin_register_vcpu_insn_exec_cb(instruction, execute, no_registers, &one);
}

void translated(PluginId, TranslationBlock* block) {
  for (std::size_t i = 0; i < qemu_plugin_tb_n_insns(block); ++i) translate(qemu_plugin_tb_get_insn(block, i));
}

void take_argument(const std::string& name, const std::string& value) {
  if (name == "core") is_m4f = value == "m4f";
  const std::size_t bar = name.find('_');
  if (bar == std::string::npos) return;
  Mark& mark = marks[name.substr(0, bar)];
  mark.name = name.substr(0, bar);
  (name.substr(bar) == "_begin" ? begin_addresses : end_addresses)[std::strtoull(value.c_str(), nullptr, 0)] = &mark;
}

}  // namespace

extern "C" [[gnu::visibility("default")]] int qemu_plugin_install(PluginId id, const void*, int count_of,
                                                                  char** texts) {
  for (int i = 0; i < count_of; ++i) {
    const std::string text = texts[i];
    const std::size_t equals = text.find('=');
    if (equals != std::string::npos) take_argument(text.substr(0, equals), text.substr(equals + 1));
  }
  qemu_plugin_register_vcpu_tb_trans_cb(id, translated);
  return 0;
}
