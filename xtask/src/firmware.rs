//! The firmware of the real boards: built, held against its budget, put onto a board.

use crate::device::{self, Route};
use crate::process::{self, Failure};
use crate::{in_root, tools};
use clap::ValueEnum;
use object::elf::{PT_LOAD, SHF_ALLOC};
use object::read::elf::{ElfFile32, FileHeader, ProgramHeader, SectionHeader};
use object::{Endianness, Object, ObjectSymbol};
use serde::Deserialize;
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Where the firmware is.
const FOLDER: &str = "firmware/shoe";

/// Where the programs for the emulator are.
const EMULATOR: &str = "firmware/emulator";

/// Its program.
const SHOE: &str = "shoe";

/// Everything from here on is RAM, everything below flash (ARMv7-M Architecture Reference Manual, B3.1).
const RAM: u64 = 0x2000_0000;

/// A board that the firmware runs on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Board {
    /// STM32WB55RG, worn on the shoe.
    Wb55,
    /// STM32F405RG, on the bench.
    F405,
}

impl Board {
    /// All of them.
    const ALL: [Self; 2] = [Self::Wb55, Self::F405];

    /// As cargo takes them.
    fn features(self, ble: bool) -> String {
        let board = match self {
            Self::Wb55 => "board-wb55",
            Self::F405 => "board-f405",
        };
        format!("{board}{}", if ble { ",ble" } else { "" })
    }

    /// As probe-rs calls it.
    fn chip(self) -> &'static str {
        match self {
            Self::Wb55 => "STM32WB55RGVx",
            Self::F405 => "STM32F405RGTx",
        }
    }
}

/// Which boards to build for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum Boards {
    /// STM32WB55RG, worn on the shoe.
    Wb55,
    /// STM32F405RG, on the bench.
    F405,
    /// All of them.
    #[default]
    All,
}

/// What to build.
#[derive(clap::Args)]
pub struct Arguments {
    /// The board.
    #[arg(long, value_enum, default_value_t)]
    board: Boards,
    /// Instead, lints the programs of all boards and of the emulator.
    #[arg(long, conflicts_with = "board")]
    lint: bool,
}

/// What to put where.
#[derive(clap::Args)]
pub struct FlashArguments {
    /// The board that is connected.
    #[arg(long, value_enum, default_value = "wb55")]
    board: Board,
    /// The program: `shoe`, or one of `bringup_spi`, `bringup_fifo`, `bringup_uart`.
    #[arg(long, default_value = "shoe")]
    bin: String,
    /// With Bluetooth, by a module at the second serial line.
    #[arg(long)]
    ble: bool,
}

/// The most that the firmware may take. **Units:** bytes.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Budget {
    flash: u64,
    statics: u64,
    /// Statics and stack: here as the memory map reserves it, in `emulate` as deep as it goes.
    pub ram: u64,
}

/// The budgets without and with Bluetooth.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Budgets {
    /// A shoe with its serial line alone.
    pub wired: Budget,
    /// One with Bluetooth beside it.
    pub ble: Budget,
}

impl Budgets {
    /// Those of the repository.
    pub fn read() -> Result<Self, Failure> {
        read_budgets(&in_root("firmware/budget.toml"))
    }
}

/// What a program takes. **Units:** bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Size {
    flash: u64,
    statics: u64,
    stack: u64,
}

impl Size {
    fn ram(self) -> u64 {
        self.statics + self.stack
    }

    /// What is over the budget, in words.
    fn objection(self, budget: Budget) -> Option<String> {
        let over = |what, is, most| (is > most).then(|| format!("{is} bytes of {what}, of {most}"));
        over("flash", self.flash, budget.flash)
            .or_else(|| over("statics", self.statics, budget.statics))
            .or_else(|| over("RAM", self.ram(), budget.ram))
    }
}

/// Builds all programs for the boards, `shoe` without and with Bluetooth, and holds it against its budgets; or lints.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    if arguments.lint {
        return lint();
    }
    let boards = match arguments.board {
        Boards::All => &Board::ALL[..],
        Boards::Wb55 => &[Board::Wb55],
        Boards::F405 => &[Board::F405],
    };
    let budgets = Budgets::read()?;
    let mut objections = Vec::new();
    let mut rows = Vec::new();
    for &board in boards {
        let mut measure = |binary: &str, name: &str, budget: Option<Budget>| {
            let elf = device::binary(binary);
            let size = size(&read(&elf)?).map_err(|trouble| Failure::Found(format!("{}: {trouble}", elf.display())))?;
            let over = budget.and_then(|budget| size.objection(budget));
            objections.extend(over.map(|over| format!("{name} for {board:?}: {over}")));
            rows.push(row(&format!("{board:?}"), name, [size.flash, size.statics, size.stack, size.ram()]));
            Ok::<_, Failure>(())
        };
        build(board, false, &["--bins"])?;
        for name in programs()? {
            measure(&name, &name, (name == SHOE).then_some(budgets.wired))?;
        }
        build(board, true, &["--bin", SHOE])?;
        measure(SHOE, "shoe, ble", Some(budgets.ble))?;
    }
    println!("{:<6} {:<14} {:>9} {:>9} {:>9} {:>9}", "board", "bytes", "flash", "statics", "stack", "RAM");
    rows.iter().for_each(|row| println!("{row}"));
    for (name, budget) in [("budget, shoe", budgets.wired), ("budget, ble", budgets.ble)] {
        println!("{:<6} {name:<14} {:>9} {:>9} {:>9} {:>9}", "", budget.flash, budget.statics, "", budget.ram);
    }
    println!("the stack is what the memory map reserves; how deep it goes, `cargo xtask emulate --check` measures");
    if objections.is_empty() { Ok(()) } else { Err(Failure::Found(objections.join("; "))) }
}

fn row(board: &str, program: &str, numbers: [u64; 4]) -> String {
    let numbers: String = numbers.iter().map(|number| format!(" {number:>9}")).collect();
    format!("{:<6} {program:<14}{numbers}", board.to_lowercase())
}

/// Puts a program onto the board that is connected, starts it and shows what it says.
pub fn flash(arguments: &FlashArguments) -> Result<(), Failure> {
    let names = programs()?;
    if !names.contains(&arguments.bin) {
        return Err(Failure::Found(format!("no program `{}`; there are {}", arguments.bin, names.join(", "))));
    }
    if tools::on_path("probe-rs").is_none() {
        let how = "cargo install --locked probe-rs-tools (https://probe.rs)";
        return Err(Failure::Missing { what: "probe-rs, which writes the flash".into(), how: how.into() });
    }
    if arguments.ble && arguments.bin != SHOE {
        return Err(Failure::Found(format!("only `{SHOE}` has Bluetooth, `{}` does not", arguments.bin)));
    }
    build(arguments.board, arguments.ble, &["--bin", &arguments.bin])?;
    let mut command = Command::new("probe-rs");
    process::run(command.args(["run", "--chip", arguments.board.chip()]).arg(device::binary(&arguments.bin)))
}

fn build(board: Board, ble: bool, what: &[&str]) -> Result<(), Failure> {
    let mut command = Route::find()?.build(&in_root(FOLDER));
    process::run(command.args(what).args(["--features", &board.features(ble)]))
}

/// Lints the firmware for all boards and for the emulator, without and with Bluetooth, where there is a clippy for the target.
fn lint() -> Result<(), Failure> {
    let boards = Board::ALL.into_iter().flat_map(|board| [board.features(false), board.features(true)]);
    let boards = boards.map(|features| (FOLDER, features));
    let emulator = ["documented", "ble"].map(|features| (EMULATOR, features.into()));
    for (folder, features) in boards.chain(emulator) {
        let Some(mut command) = Route::find()?.clippy(&in_root(folder)) else {
            println!("no clippy for {}: the firmware is not linted", device::TARGET);
            return Ok(());
        };
        process::run(command.args(["--features", &features, "--", "-D", "warnings"]))?;
    }
    Ok(())
}

/// The programs of the firmware: `shoe`, then one for each file in `src/bin`.
fn programs() -> Result<Vec<String>, Failure> {
    let folder = in_root(FOLDER).join("src/bin");
    let failure = |source| Failure::File { path: folder.display().to_string(), source };
    let mut names = Vec::new();
    for entry in fs::read_dir(&folder).map_err(failure)? {
        let path: PathBuf = entry.map_err(failure)?.path();
        names.extend(path.file_stem().map(|stem| stem.to_string_lossy().into_owned()));
    }
    names.sort();
    names.insert(0, SHOE.into());
    Ok(names)
}

fn read(path: &Path) -> Result<Vec<u8>, Failure> {
    fs::read(path).map_err(|source| Failure::File { path: path.display().to_string(), source })
}

fn read_budgets(path: &Path) -> Result<Budgets, Failure> {
    let text = String::from_utf8_lossy(&read(path)?).into_owned();
    toml::from_str(&text)
        .map_err(|error| Failure::Found(format!("{}: {}", path.display(), error.message().replace('\n', " "))))
}

/// What the program in `elf` takes. An error when it is no such program, or when writing it would overwrite the store.
fn size(elf: &[u8]) -> Result<Size, String> {
    let file: ElfFile32<'_> = ElfFile32::parse(elf).map_err(|error| error.to_string())?;
    let symbol = |name: &str| {
        let found = file.symbols().find(|symbol| symbol.name() == Ok(name));
        found.map(|symbol| symbol.address()).ok_or_else(|| format!("no symbol {name}"))
    };
    let endian = file.endian();
    let store = symbol("_store_start")?..symbol("_store_end")?;
    let flash = filled(loaded(&file, endian), &store)?;
    let statics = statics(&file, elf)?;
    let stack = symbol("_stack_start")?.saturating_sub(symbol("_stack_end")?);
    Ok(Size { flash, statics, stack })
}

/// What the program in `elf` keeps in RAM, but for the statics of these names. **Units:** bytes.
pub fn statics_without(elf: &Path, names: &[&str]) -> Result<u64, Failure> {
    let bytes = read(elf)?;
    let without = || {
        let file: ElfFile32<'_> = ElfFile32::parse(&*bytes).map_err(|error| error.to_string())?;
        let left_out = |name: &&str| {
            // In the mangled name, its own comes last, after its length.
            let end = format!("{}{name}", name.len());
            let symbol = file.symbols().find(|symbol| symbol.name().is_ok_and(|mangled| mangled.ends_with(&end)));
            symbol.map(|symbol| symbol.size()).ok_or_else(|| format!("no static {name}"))
        };
        let left_out: u64 = names.iter().map(left_out).sum::<Result<_, String>>()?;
        Ok(statics(&file, &bytes)?.saturating_sub(left_out))
    };
    without().map_err(|trouble: String| Failure::Found(format!("{}: {trouble}", elf.display())))
}

/// What lies in RAM. **Units:** bytes.
fn statics(file: &ElfFile32<'_>, elf: &[u8]) -> Result<u64, String> {
    let endian = file.endian();
    let sections = file.elf_header().section_headers(endian, elf).map_err(|error| error.to_string())?;
    let in_ram = |section: &&object::elf::SectionHeader32<Endianness>| {
        section.sh_flags(endian) & SHF_ALLOC != 0 && u64::from(section.sh_addr(endian)) >= RAM
    };
    Ok(sections.iter().filter(in_ram).map(|section| u64::from(section.sh_size(endian))).sum())
}

/// How much of the flash is written; an error when a part of the store is.
fn filled(mut parts: impl Iterator<Item = Range<u64>>, store: &Range<u64>) -> Result<u64, String> {
    parts.try_fold(0, |sum, part| {
        if part.start < store.end && store.start < part.end {
            let (part, store) = ((part.start, part.end), (store.start, store.end));
            let of = |(start, end)| format!("{start:#x} to {end:#x}");
            return Err(format!("it fills {}, but {} is the store", of(part), of(store)));
        }
        Ok(sum + (part.end - part.start))
    })
}

/// What is written into the flash.
fn loaded<'a>(file: &'a ElfFile32<'_>, endian: Endianness) -> impl Iterator<Item = Range<u64>> + 'a {
    let all = file.elf_program_headers().iter().filter(move |segment| segment.p_type(endian) == PT_LOAD);
    all.map(move |segment| {
        let start = u64::from(segment.p_paddr(endian));
        start..start + u64::from(segment.p_filesz(endian))
    })
    .filter(|range| !range.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_over_a_budget_is_named_with_its_size() {
        let budget = Budget { flash: 100, statics: 50, ram: 80 };
        let size = |flash, statics, stack| Size { flash, statics, stack };
        assert_eq!(size(100, 50, 30).objection(budget), None);
        assert_eq!(size(101, 1, 1).objection(budget).as_deref(), Some("101 bytes of flash, of 100"));
        assert_eq!(size(1, 51, 1).objection(budget).as_deref(), Some("51 bytes of statics, of 50"));
        assert_eq!(size(1, 50, 31).objection(budget).as_deref(), Some("81 bytes of RAM, of 80"));
    }

    #[test]
    fn a_program_goes_around_the_store_but_not_into_it() {
        let store = 0x4000..0xc000;
        let (vectors, program) = (0x0..0x188, 0xc000..0xd000);
        assert_eq!(filled([vectors.clone(), program].into_iter(), &store), Ok(0x1188));
        for part in [0x3ff0..0x4001, 0x5000..0x5001, 0xbfff..0xd000, 0x0..0x10_0000] {
            assert!(filled([vectors.clone(), part].into_iter(), &store).is_err());
        }
    }

    #[test]
    fn the_budgets_of_the_repository_are_read() {
        let Budgets { wired, ble } = read_budgets(&in_root("firmware/budget.toml")).unwrap();
        for budget in [wired, ble] {
            assert!(budget.flash > 0 && budget.statics > 0 && budget.statics < budget.ram);
        }
    }

    #[test]
    fn what_is_no_program_has_no_size() {
        assert!(size(b"\x7fELF").is_err());
    }
}
