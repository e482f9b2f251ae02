//! All rules, in the order in which they are applied.

use super::rule::Find::{Check, Last, Read};
use super::rule::Rule;
use super::{cia301, info, limits, lines, lists, numbers, objects, overlays, pdo, xdd};
use crate::diagnostic::Severity;

/// One row each: code, severity, where the findings come from, the requirement, why it matters, and what is fixed
/// without asking.
macro_rules! rules {
    ($($code:literal $severity:ident $find:expr, $holds:literal, $why:literal $(, fixes $fixes:literal)?;)*) => {
        pub(super) const RULES: &[Rule] = &[$({
            let fixes: &[&str] = &[$($fixes)?];
            Rule { code: $code, severity: Severity::$severity, holds: $holds, why: $why, fixes: fixes.first().copied(), find: $find }
        },)*];
    };
}

rules! {
    "eds::file-size" Error Read(lines::file_size),
        "A file has at most 64 MiB and a million lines.",
        "Data sheets of the largest devices known have some 2 MB. A file beyond the bounds is something else, or an \
         attempt to exhaust memory; it is not read at all.";
    "eds::xml" Error Read(lines::xml),
        "A data sheet in XML is a whole XDD, XDC or XPD of CiA 311.",
        "It is read within bounds (16 MiB, a million nodes), without document type definitions, and only if its root element \
         and namespace are those of CiA 311: other formats describe devices with the same words, but not the same meaning.";
    "xdd::dangling-reference" Warning Read(xdd::dangling_reference),
        "Each `uniqueIDRef` of an object names a parameter.",
        "The parameter says data type, access, default and limits of the object. Without it only the attributes of the object \
         itself count, and most tools write none.";
    "xdd::duplicate-id" Warning Read(xdd::duplicate_id),
        "No `uniqueID` comes twice.",
        "What refers to it means one of the two, and readers differ in which. The first one counts here.";
    "xdd::not-read" Note Read(xdd::not_read),
        "All that an XDD says is in the model.",
        "CiA 311 has pictures, indicators, function blocks and modules that no EDS has, and that no command here needs. The \
         rest of the file is read.";
    "eds::project" Error Read(lines::project),
        "A data sheet describes a device, not a network.",
        "A CPJ (CiA 306-3) has a section `[Topology]` that names the nodes of a network and their DCF files. It has no \
         objects; read the DCF of a node instead.";
    "eds::encoding" Note Read(lines::encoding),
        "Text outside ASCII is UTF-8 without byte order mark.",
        "CiA 306-1 knows ASCII only. Names with umlauts or degree signs come in code page 1252 or in UTF-8; bytes \
         that are not UTF-8 are read as code page 1252, and a byte order mark is dropped.";
    "eds::long-line" Note Read(lines::long_line),
        "A line has at most 255 characters.",
        "CiA 306-1 limits lines to 255 characters, and readers with a fixed buffer cut them there. Longer lines are \
         read whole here.";
    "eds::unclosed-section" Warning Read(lines::unclosed_section),
        "A section name ends with a bracket.",
        "Without the closing bracket other readers take the section for a key or swallow the lines after it. The \
         rest of the line is taken for the name.",
        fixes "Closes the name of a section that is known.";
    "eds::text-after-section" Warning Read(lines::text_after_section),
        "Nothing but a comment follows a section name on its line.",
        "Some readers refuse the file, others take the text for a key. It is ignored here.",
        fixes "Makes a comment of the text.";
    "eds::no-equals-sign" Warning Read(lines::no_equals_sign),
        "A key and its value are separated by an equals sign.",
        "A colon or a blank instead is read as an equals sign where the line leaves no doubt. Other readers lose the \
         line, or take the next one for a part of it.",
        fixes "Writes an equals sign after a key that is known.";
    "eds::stray-text" Warning Read(lines::stray_text),
        "A line is empty, a comment, a section or a key with a value.",
        "A line that is none of these says nothing that could be used. Often it is the rest of a text that an editor \
         has wrapped.";
    "eds::tokenizer" Note Read(lines::tokenizer),
        "The tokeniser and the search for places see the same sections and keys.",
        "Where they do not, the lines themselves are read. This is a mistake of the reader, not of the file; please \
         report it with the file.";
    "eds::key-outside-section" Warning Read(lines::key_outside_section),
        "Every key is in a section.",
        "What a key means depends on its section, so keys before the first section cannot be used.";
    "eds::unknown-section" Warning Read(lines::unknown_section),
        "Every section is one that CiA 306 knows.",
        "Vendors add sections for their own tools; CiA 306-1 lets other readers ignore them. A misspelt name of an \
         object looks the same, so each is named.";
    "eds::duplicate-section" Warning Read(lines::duplicate_section),
        "No two sections have the same name.",
        "Readers differ in which one they take. The first one counts here, as with the functions of Windows that \
         data sheets were made for.",
        fixes "Removes the second section if it says the same.";
    "eds::unknown-key" Note Read(lines::unknown_key),
        "Every key is one that CiA 306 knows for its section.",
        "Vendors add keys for their own tools; CiA 306-1 lets other readers ignore them. A misspelt key looks the \
         same, so each name is reported once, at its first place.";
    "eds::key-without-effect" Note Read(lines::key_without_effect),
        "A key stands where it means something.",
        "The data type, access type or value of an ARRAY or RECORD is that of its sub-indices; the same keys in the \
         section of the object mean nothing unless `CompactSubObj` is used, nor does `SubNumber` in the section of a \
         sub-index.";
    "eds::duplicate-key" Warning Read(lines::duplicate_key),
        "No key comes twice in a section.",
        "Readers differ in which one they take. The first one counts here, as with the functions of Windows that \
         data sheets were made for.",
        fixes "Removes the second line if it says the same.";
    "eds::empty-number" Note Read(lines::empty_number),
        "Keys that hold numbers hold one.",
        "Editors write keys without value where nothing was entered. They are read as absent keys.";
    "eds::bad-number" Warning Read(numbers::bad_number),
        "Where a number belongs there is one.",
        "Numbers are decimal, hexadecimal with `0x` or octal with a leading zero (CiA 306-1). The key is read as \
         absent.";
    "eds::number-too-large" Warning Read(numbers::number_too_large),
        "A number is not larger than its key can hold.",
        "Object codes, sub-index counts and versions have 8 bits, indices 16, identity numbers 32. The key is read \
         as absent.";
    "eds::bad-flag" Warning Read(numbers::bad_flag),
        "Flags are 0 or 1.",
        "CiA 306 knows 0 for no and 1 for yes. Every other number is read as yes.",
        fixes "Writes 1.";
    "eds::octal-number" Warning Read(numbers::octal_number),
        "A decimal number has no leading zero.",
        "CiA 306-1 follows C: a leading zero means octal, so 010 is eight. People who pad numbers with zeros mean \
         decimal. The standard is followed where all digits are octal; an overlay can say what was meant.",
        fixes "Removes the zero if the digits are not octal.";
    "eds::inline-comment" Warning Read(numbers::inline_comment),
        "No comment follows a number on its line.",
        "In CiA 306-1 a comment has a line of its own. Other readers refuse the number or take it for text.",
        fixes "Moves the comment to a line of its own.";
    "eds::odd-number" Note Read(numbers::odd_number),
        "Numbers are spelled as CiA 306 spells them.",
        "`true`, `NULL`, `1.0f`, `1F80h` or the name of a data type mean one thing only and are read so, but other \
         readers refuse them.",
        fixes "Writes the number as CiA 306 does.";
    "eds::real-bits" Note Read(limits::real_bits),
        "A REAL is given as a decimal number.",
        "Some editors write the bits of IEEE 754 as a hexadecimal number where others write 1.5. Hexadecimal is read as \
         bits here; readers that take it for an integer get another number.";
    "eds::unknown-variable" Warning Read(numbers::unknown_variable),
        "The only variable in a value is $NODEID.",
        "CiA 306-1 knows `$NODEID` and no other variable. Another name is read as if it were `$NODEID`, which it \
         usually means.";
    "eds::octet-string" Note Read(numbers::octet_string),
        "The value of an OCTET_STRING is in hexadecimal.",
        "CiA 306-1 writes the octets as pairs of hexadecimal digits. Text is kept as text.";
    "eds::bad-value" Warning Read(numbers::bad_value),
        "Defaults and limits are values of the data type.",
        "A value that its data type cannot have is read as absent. Either the value or the data type is wrong; an \
         overlay mends both.";
    "eds::entry-count" Warning Read(numbers::entry_count),
        "NrOfEntries, Lines and the like are the number of entries that follow.",
        "Readers that trust the number lose the entries beyond it. Here all entries are read.",
        fixes "Writes the number of entries.";
    "eds::value-without-entry" Warning Read(numbers::value_without_entry),
        "Names and values are given to sub-indices that exist.",
        "`[xxxxName]`, `[xxxxValue]` and `[xxxxDenotation]` belong to sub-indices of the object; the key is the \
         sub-index in decimal.";
    "eds::nested-object" Warning Read(objects::nested_object),
        "A sub-index is a VAR or a DOMAIN.",
        "CANopen has two levels only, objects and sub-indices (CiA 301, 7.4.3). The entry is read as a VAR.",
        fixes "Writes VAR.";
    "eds::bad-object-type" Warning Read(objects::bad_object_type),
        "ObjectType is one of the object codes of CiA 301.",
        "NULL 0, DOMAIN 2, DEFTYPE 5, DEFSTRUCT 6, VAR 7, ARRAY 8, RECORD 9 (CiA 301, table 42). Another code is \
         read as if the key were absent.";
    "eds::missing-data-type" Warning Read(objects::missing_data_type),
        "Every variable names its data type.",
        "Without data type the value can only be transferred as raw bytes. A DOMAIN needs none.";
    "eds::unknown-data-type" Warning Read(objects::unknown_data_type),
        "Data types are those of CiA 301 or of the device itself.",
        "Data types have the indices 0001h to 025Fh (CiA 301, 7.4.1). Others are kept as a number, and nothing can \
         be generated for them.";
    "eds::missing-access-type" Warning Read(objects::missing_access_type),
        "Every variable names its access type.",
        "Without access type the entry is read as `rw`, and the device decides.";
    "eds::bad-access-type" Warning Read(objects::bad_access_type),
        "Access types are ro, wo, rw, rwr, rww or const.",
        "CiA 306-1 (6.5.2) knows six words, in any case. Others are read as what they seem to mean.",
        fixes "Writes the word of CiA 306 if it is beyond doubt.";
    "eds::bad-dummy" Warning Read(info::bad_dummy),
        "Dummies are data types of a fixed size.",
        "A dummy (CiA 301) is the index of a data type that a PDO maps to leave a gap, so it needs a size.";
    "eds::bad-channel" Warning Read(info::bad_channel),
        "A segment of dynamic channels has a range of indices.",
        "`RangeN` names the first and the last index: `0xA080-0xA0BF` (CiA 302-4). Without it the segment is of no \
         use.";
    "eds::object-without-section" Warning Read(lists::object_without_section),
        "Every object that a list names is described by a section.",
        "Of an object without section nothing is known but that it exists. Often the list was copied from another \
         device.";
    "overlay::syntax" Error Read(overlays::syntax),
        "An overlay is TOML.",
        "What is broken is skipped; the rest of the overlay is applied.";
    "overlay::format" Error Read(overlays::format),
        "An overlay names a format that is known.",
        "`format = 1` in `[overlay]` says how the overlay is meant, so that a later format cannot be taken for this \
         one.";
    "overlay::unknown-key" Error Read(overlays::unknown_key),
        "Every key of an overlay is one that is known.",
        "An overlay is written for this reader, so an unknown key is a slip that would otherwise lose what was \
         meant.";
    "overlay::bad-value" Error Read(overlays::bad_value),
        "Every value of an overlay is of the kind that its key takes.",
        "What is of another kind is read as absent: a text where a number belongs, a word that is none of those that \
         are allowed, a table without what it must have.";
    "overlay::unknown-object" Error Read(overlays::unknown_object),
        "What an overlay speaks of is in the data sheet.",
        "An overlay corrects and explains what is there; addresses are hexadecimal, `2410` or `2410:05`.";
    "overlay::missing-reason" Error Read(overlays::missing_reason),
        "A correction says why.",
        "A later reader has to judge whether the correction still holds: name the page of the manual, the firmware or \
         the measurement.";
    "overlay::no-effect" Warning Read(overlays::no_effect),
        "A correction says something else than the data sheet.",
        "A correction of what is right already was made for another version of the data sheet, or for another \
         device.";
    "overlay::two-meanings" Error Read(overlays::two_meanings),
        "An entry is a quantity, an enumeration or a bit field, but only one of them.",
        "The meaning decides the type of the value in generated code, so there can be one only.";
    "overlay::range-reversed" Error Read(overlays::range_reversed),
        "A range begins with its smaller end.",
        "No value lies in a range whose low end is above its high end.";
    "overlay::duplicate-value" Error Read(overlays::duplicate_value),
        "The values and the names of an enumeration differ.",
        "A number with two names, or a name for two numbers, cannot become an enumeration in code. The first one \
         counts.";
    "overlay::overlapping-bits" Error Read(overlays::overlapping_bits),
        "The bits and the names of a bit field differ.",
        "Every bit has one meaning, and every name becomes one method in generated code. The first field counts.";
    "overlay::units" Error Read(overlays::units),
        "A quantity has one unit, or several of which each has a condition.",
        "Where other objects decide the unit, as with increments or millimetres by the spindle pitch, every unit \
         says when it applies.";
    "overlay::duplicate-parameter" Error Read(overlays::duplicate_parameter),
        "The parameters of an interface have different numbers.",
        "A number stands for one parameter, or for several under different conditions, as a setpoint that is a position \
         or a velocity by the operating mode. The first one counts.";
    "overlay::parameter-outside-type" Error Check(overlays::parameter_outside_type),
        "The data type of a parameter holds what its object holds.",
        "An interface may carry an object in another data type. What that cannot hold could be neither read nor written \
         there.";
    "overlay::parameter-range" Error Check(overlays::parameter_range),
        "A parameter has no wider range than its object.",
        "Behind both is one value. If the interface really takes more, the limits of the object are wrong.";
    "overlay::undefined-name" Error Check(overlays::undefined_name),
        "Every quantity, enumeration, bit field and value that is used is defined.",
        "The name must be that of a table `[quantity.…]`, `[enumeration.…]` or `[bit_field.…]` of the overlay, in \
         the same case; values of a parameter have the names of the enumeration.";
    "overlay::unused-name" Warning Check(overlays::unused_name),
        "Every quantity, enumeration and bit field that is defined is used.",
        "An unused table is left over, or its name is misspelt where it should be used.";
    "overlay::mixed-types" Error Check(overlays::mixed_types),
        "All users of a quantity, enumeration or bit field have the same data type.",
        "Each becomes one type in generated code, with one size on the bus. Give the entries of another data type a \
         table of their own.";
    "overlay::meaning-outside-type" Error Check(overlays::meaning_outside_type),
        "The values, bits and ranges that an overlay names fit the data type.",
        "A value that the data type cannot have, or a bit beyond its last, is a slip in the overlay or a wrong data \
         type in the data sheet.";
    "overlay::unknown-condition" Error Check(overlays::unknown_condition),
        "A condition asks for an entry that exists and is a number.",
        "Generated code and the tools read the entry to decide which unit or range applies.";
    "overlay::accepted-in-vain" Warning Last,
        "What an overlay accepts is found without it.",
        "`accept` says that a finding is intended. If it is no longer found, the data sheet was mended, or the overlay is \
         for another version of the data sheet.";
    "eds::missing-section" Warning Check(info::missing_section),
        "FileInfo, DeviceInfo and MandatoryObjects are there.",
        "CiA 306-1 requires the three sections; other readers refuse the file without them. What they say is unknown \
         then, and objects are read from their sections all the same.";
    "eds::missing-device-info" Note Check(info::missing_device_info),
        "DeviceInfo says who made what, and what it can do.",
        "CiA 306-1 (6.4) requires these keys. What is missing is read as unknown, or as not supported.";
    "eds::no-bit-rate" Warning Check(info::no_bit_rate),
        "The device supports at least one bit rate.",
        "Every `BaudRate_` is 0 or missing, so no bus could have the device on it.";
    "eds::bad-date" Note Check(info::bad_date),
        "Dates are mm-dd-yyyy and times hh:mmAM or hh:mmPM.",
        "CiA 306-1 (6.3) has one form for dates and one for times. Others are kept as they are.",
        fixes "Writes date and time in the form of CiA 306 if their order is beyond doubt.";
    "eds::bad-granularity" Warning Check(info::bad_granularity),
        "The granularity is at most 64 bits.",
        "Granularity (CiA 306-1, 6.4) is the smallest piece in bits that a PDO can map, from 1 to 64; 0 means that \
         mappings cannot be changed.";
    "eds::dynamic-channels" Warning Check(info::dynamic_channels),
        "`DynamicChannelsSupported` and `[DynamicChannels]` agree.",
        "A device either has segments for network variables (CiA 302-4) and says so, or neither.";
    "eds::compact-pdo" Note Check(info::compact_pdo),
        "PDO parameters are written out.",
        "`CompactPDO` (CiA 306-1, 6.4) lets a data sheet leave out PDO parameters: they have the sub-indices that \
         its bits name, the COB-IDs of the predefined connection set, and empty mappings. They are added here; many \
         readers do not see them.";
    "eds::bad-compact-pdo" Warning Check(info::bad_compact_pdo),
        "CompactPDO says all that is needed of the PDOs that are left out.",
        "Bits 0 to 5 of `CompactPDO` (CiA 306-1, 6.4) are sub-indices 1 to 6 of the communication parameters that \
         are left out; without the first two a PDO has no COB-ID or no transmission type (CiA 301, 7.5.2.35). \
         `NrOfRXPDO` and `NrOfTXPDO` say how many PDOs there are, and with a `Granularity` of 0 their mappings could \
         not be written, so that they had to be in the file.";
    "eds::bad-node-id" Warning Check(info::bad_node_id),
        "The node-ID of a DCF is 1 to 127.",
        "CiA 301 has node-IDs from 1 to 127; 255 marks a device that waits for LSS.";
    "eds::unsupported-bit-rate" Warning Check(info::unsupported_bit_rate),
        "The bit rate of a DCF is one that the device supports.",
        "The bit rate under `[DeviceComissioning]` must be one whose `BaudRate_` in `[DeviceInfo]` is 1.";
    "eds::module-without-section" Warning Check(info::module_without_section),
        "Every supported module is described.",
        "`[SupportedModules]` says how many modules there are; each has a section `[M1ModuleInfo]` and so on.";
    "eds::unsupported-module" Warning Check(info::unsupported_module),
        "Every module that a DCF plugs in is one that the device supports.",
        "`[ConnectedModules]` names modules by their number in `[SupportedModules]`.";
    "eds::list-count" Warning Check(lists::list_count),
        "SupportedObjects is the number of objects in its list.",
        "Readers that trust the number lose the objects beyond it. All objects that are listed or described are \
         read.",
        fixes "Writes the number of objects.";
    "eds::list-gap" Warning Check(lists::list_gap),
        "The objects of a list are numbered from 1 without gap.",
        "Readers that count up from 1 stop at the first gap and lose what comes after it.",
        fixes "Numbers the objects from 1.";
    "eds::object-not-listed" Warning Check(lists::object_not_listed),
        "Every object that is described is in a list.",
        "CiA 306-1 lets a reader ignore objects that no list names, and several do. They are read here.";
    "eds::listed-twice" Warning Check(lists::listed_twice),
        "An object is listed once.",
        "Readers that build an object for each line of a list build two.",
        fixes "Removes the second line.";
    "eds::wrong-list" Warning Check(lists::wrong_list),
        "Objects are in the list that their index belongs to.",
        "2000h to 5FFFh are the manufacturer's; mandatory are 1000h, 1001h and 1018h, and what a profile demands \
         (CiA 306-1).",
        fixes "Moves the object to its list.";
    "cia301::missing-object" Warning Check(cia301::missing_object),
        "The objects that CiA 301 demands of every device are there.",
        "Every device has a device type (1000h), an error register (1001h) and an identity (1018h).";
    "eds::reserved-index" Warning Check(objects::reserved_index),
        "The index of an object is not reserved.",
        "CiA 301 (7.4.1) reserves 0000h, 0260h to 0FFFh and C000h to FFFFh.";
    "eds::missing-name" Warning Check(objects::missing_name),
        "Every object and every entry has a name.",
        "Without `ParameterName` tools have only the address to show, and generated code only the address to go by.";
    "eds::long-name" Note Check(objects::long_name),
        "A name has at most 241 characters.",
        "CiA 306-1 (6.5.2) limits `ParameterName` to 241 characters; other readers may cut it there.";
    "eds::same-name" Note Check(objects::same_name),
        "Names differ when blanks and signs are left out.",
        "Generated code turns names into identifiers, and `Speed (max)` and `Speed max` become the same. Such names \
         get their address added; an overlay gives better ones.";
    "eds::sub-without-object" Warning Check(objects::sub_without_object),
        "Every sub-index belongs to an object with a section.",
        "Without the section of the object its name and type are unknown. It is read as a RECORD without name.";
    "eds::sub-count" Warning Check(objects::sub_count),
        "SubNumber is the number of sub-indices.",
        "SubNumber (CiA 306-1, 6.5.2) counts the sections of the sub-indices, 0 included. Readers that trust it lose \
         those beyond it.",
        fixes "Writes the number of sub-indices.";
    "eds::variable-with-subs" Warning Check(objects::variable_with_subs),
        "Only arrays and records have sub-indices.",
        "An object with sub-indices whose `ObjectType` is missing, or is that of a single value, is read as a \
         RECORD.";
    "eds::no-subs" Warning Check(objects::no_subs),
        "Arrays and records have sub-indices.",
        "An array or record without sub-indices has nothing that could be read or written.";
    "eds::missing-sub-0" Warning Check(objects::missing_sub_0),
        "Arrays and records have a sub-index 0.",
        "Sub-index 0 holds the highest sub-index (CiA 301, 7.4.3). Tools that read it first find nothing.";
    "eds::sub-0-type" Warning Check(objects::sub_0_type),
        "Sub-index 0 of an array or record is an UNSIGNED8.",
        "The highest sub-index has one byte (CiA 301, 7.4.3). A device answers with one byte even if the data sheet \
         says otherwise.";
    "eds::highest-sub" Warning Check(objects::highest_sub),
        "The default of sub-index 0 is the highest sub-index.",
        "Sub-index 0 says how far to read (CiA 301, 7.4.3). The number of faults in 1003h and the number of objects \
         in a mapping are not meant.";
    "eds::array-types" Warning Check(objects::array_types),
        "The entries of an array have one data type.",
        "What has several data types is a RECORD (CiA 301, table 42). Each entry keeps the data type that it names.";
    "eds::decimal-sub-index" Warning Check(objects::decimal_sub_index),
        "The sub-index in the name of a section is hexadecimal.",
        "After `[2000sub9]` comes `[2000subA]`; `[2000sub10]` is sub-index 16. A gap from 0Ah to 0Fh suggests that \
         the sub-indices were counted in decimal.";
    "eds::compact-count" Warning Check(objects::compact_count),
        "CompactSubObj is at most 254.",
        "Sub-indices go from 0 to FEh (CiA 301, 7.4.3). What is beyond is not read.";
    "eds::undescribed-type" Warning Check(objects::undescribed_type),
        "Data types that the device defines are described.",
        "From 0040h on data types are objects of the device itself (CiA 301, 7.4.1). Without their description the \
         size of a value is unknown.";
    "eds::broken-link" Warning Check(objects::broken_link),
        "ObjectLinks and InvertedSRAD name objects that are there.",
        "`[xxxxObjectLinks]` (CiA 306-1) lists objects that belong together, and `InvertedSRAD` is the index and sub-index of what holds \
         the same value inverted, for safety-relevant messages (CiA 304).";
    "eds::too-many-entries" Error Read(objects::too_many_entries),
        "CompactSubObj and CompactPDO stand for a bounded number of entries in a file.",
        "A line of a few bytes can stand for 254 entries, or for 1024 PDO parameters, so a small file could exhaust \
         memory. The largest devices known have some 5000 entries. At most 100,000 entries and 16 MiB of their texts are \
         written out for `CompactSubObj`: of objects beyond that sub-index 0 alone is read. `CompactPDO` stands for nothing \
         when it would be more than 20,000.";
    "eds::limits-reversed" Warning Check(limits::limits_reversed),
        "The low limit is not above the high limit.",
        "No value can lie between reversed limits. Often the two lines were exchanged, or a negative limit was written with the \
         hexadecimal digits of a shorter type. A high limit that is only sensible as an unsigned number is read as one.";
    "eds::zero-limits" Warning Check(limits::zero_limits),
        "Limits of 0 and 0 mean that there are none.",
        "Editors write 0 for both limits where nothing was entered. Taken literally, the entry could hold nothing but 0, \
         so both are read as absent, and it can be written.",
        fixes "Removes both limits.";
    "eds::limit-outside-type" Warning Check(limits::limit_outside_type),
        "Limits are numbers of the data type.",
        "A limit that the data type cannot have limits nothing. Either the limit or the data type is wrong.";
    "eds::default-outside-type" Warning Check(limits::default_outside_type),
        "Defaults are numbers of the data type.",
        "A device cannot hold a default that its data type cannot have. Either the default or the data type is \
         wrong.";
    "eds::default-outside-limits" Warning Check(limits::default_outside_limits),
        "Defaults lie between the limits.",
        "A default outside its own limits could not be written back. One of the three numbers is wrong.";
    "eds::value-outside-limits" Warning Check(limits::value_outside_limits),
        "The values of a DCF lie between the limits.",
        "A device refuses a value outside its limits, and the download of the configuration fails with it.";
    "eds::equal-limits" Note Check(limits::equal_limits),
        "The limits of what can be written differ.",
        "When both limits are the same, one value only can be written; a default of this value says that it is meant.";
    "eds::value-not-writable" Note Check(limits::value_not_writable),
        "The values of a DCF can be written.",
        "A value of an entry that cannot be written is not downloaded: it records what the device had, which was not its default.";
    "eds::constant-without-default" Note Check(limits::constant_without_default),
        "What is const has a default.",
        "A constant never changes, so the data sheet can say its value (CiA 306-1, 6.5.2).",
        fixes "Writes the highest sub-index into sub-index 0 of an array or record.";
    "eds::unmappable-type" Warning Check(limits::unmappable_type),
        "What can be mapped into a PDO has a fixed size of at most 64 bits.",
        "A PDO has eight bytes (CiA 301, 7.2.2). Strings and domains cannot be mapped.";
    "eds::rwr-not-mappable" Note Check(limits::rwr_not_mappable),
        "What is rwr or rww can be mapped.",
        "`rwr` and `rww` say into which PDOs an entry can be mapped (CiA 306-1, 6.5.2), which makes no sense when it \
         cannot.";
    "eds::mappable-parameter" Note Check(limits::mappable_parameter),
        "Communication parameters are not mapped into PDOs.",
        "CiA 301 (7.5.2) says of each object whether it may be mapped. Of the communication profile area these are the error \
         register, the status word, the error history, the time stamp (1013h), the prompt (1026h) and the SDO parameters.";
    "pdo::missing-object" Warning Check(pdo::missing_object),
        "What a PDO maps is in the data sheet.",
        "A mapping names entries by index, sub-index and length. What is not there cannot be decoded.";
    "pdo::not-mappable" Warning Check(pdo::not_mappable),
        "What a PDO maps can be mapped.",
        "`PDOMapping` of the entry is 0, so the device should refuse the mapping that it has by default.";
    "pdo::wrong-length" Warning Check(pdo::wrong_length),
        "A mapping takes as many bits as the data type has.",
        "Eight bits of the mapping word are the length (CiA 301, 7.5.2.36). A device that maps another length than \
         the data type has refuses it, or shifts all that follows.";
    "pdo::too-long" Warning Check(pdo::too_long),
        "A PDO maps at most 64 bits.",
        "A CAN frame has eight bytes (CiA 301, 7.2.2). A device refuses a longer mapping.";
    "pdo::mapping-count" Warning Check(pdo::mapping_count),
        "Sub-index 0 of a mapping is the number of objects that are mapped.",
        "The default of sub-index 0 says how many of the words after it count (CiA 301, 7.5.2.36): at most 64, and \
         each must be there.";
    "pdo::wrong-direction" Warning Check(pdo::wrong_direction),
        "Receive PDOs write what can be written, transmit PDOs read what can be read.",
        "An entry that is `ro` cannot be set by a receive PDO, and one that is `wo` cannot be sent; `rwr` is for \
         transmit PDOs and `rww` for receive PDOs.";
    "pdo::open-direction" Note Check(pdo::open_direction),
        "What can be mapped and written says into which PDOs it can be mapped.",
        "`rw` leaves open whether an entry is an input or an output; `rwr` is for transmit PDOs and `rww` for receive PDOs \
         (CiA 306-1, 6.5.2). CiA's test tool warns of each, and leaves out its cases about the direction of a mapping (3.27, \
         3.31) where no entry says it.";
    "pdo::unusable-dummy" Warning Check(pdo::unusable_dummy),
        "Dummies that a PDO maps are in DummyUsage.",
        "A data type can be mapped to leave a gap when `[DummyUsage]` says so (CiA 306-1), and only into receive \
         PDOs.";
    "pdo::half-described" Warning Check(pdo::half_described),
        "A PDO has a communication and a mapping parameter.",
        "1400h and 1600h belong together, and so do 1800h and 1A00h: one says when, the other what (CiA 301, \
         7.5.2.35).";
    "pdo::count" Warning Check(pdo::count),
        "NrOfRXPDO and NrOfTXPDO are the numbers of PDOs.",
        "Tools that trust the numbers in `[DeviceInfo]` offer fewer or more PDOs than there are parameters for.",
        fixes "Writes the number of PDOs if there are more than the key says.";
    "pdo::cob-id-collision" Warning Check(pdo::cob_id_collision),
        "No PDO sends with the COB-ID of another.",
        "Two devices, or two PDOs of one, that send with the same identifier disturb each other. Two receive PDOs \
         may take one frame.";
    "pdo::restricted-cob-id" Warning Check(pdo::restricted_cob_id),
        "No PDO has a COB-ID that CiA 301 keeps for something else.",
        "NMT, SDO, error control and LSS have fixed identifiers (CiA 301, 7.3.5) that no PDO may use: 000h to 07Fh, \
         101h to 180h, 581h to 5FFh, 601h to 67Fh, 6E0h to 6FFh and 701h to 7FFh.";
    "pdo::cob-id-bits" Warning Check(pdo::cob_id_bits),
        "A COB-ID without bit 29 has 11 bits.",
        "Bits 11 to 28 belong to identifiers of 29 bits, which bit 29 chooses (CiA 301, 7.5.2.35). A device refuses \
         the value or cuts it.";
    "pdo::transmission-type" Warning Check(pdo::transmission_type),
        "Transmission types are those of CiA 301.",
        "0 to 240 are synchronous, 252 and 253 answer remote requests (transmit PDOs only), 254 and 255 are \
         event-driven (CiA 301, 7.5.2.35); the others are reserved.";
    "pdo::granularity" Note Check(pdo::granularity),
        "Mapped lengths are multiples of the granularity.",
        "`Granularity` in `[DeviceInfo]` is the smallest piece in bits that a PDO of this device maps. Tools that \
         trust it refuse what is smaller.";
    "cia301::object-type" Warning Check(cia301::object_type),
        "Objects of CiA 301 and of the profile have the object type of the standard.",
        "A tool that knows the standard reads 1018h as a RECORD, and 1003h as an ARRAY. Where the device really \
         differs nothing can be done; where only the data sheet does, an overlay cannot change it, but nothing is \
         lost.";
    "cia301::data-type" Warning Check(cia301::data_type),
        "Objects of CiA 301 and of the profile have the data type of the standard.",
        "A tool that knows the standard transfers as many bytes as the standard says. Where the data sheet is wrong \
         and not the device, an overlay corrects it.";
    "cia301::reserved-sub-index" Note Check(cia301::reserved_sub_index),
        "The communication parameter of a PDO has no sub-index 4.",
        "Sub-index 4 of 1400h to 15FFh and of 1800h to 19FFh is reserved and shall not be implemented (CiA 301, 7.5.2.35 and \
         7.5.2.37): a device aborts with 0609 0011h there. It was the priority group of older versions of the standard.";
    "cia301::writable" Warning Check(cia301::writable),
        "What CiA 301 fixes cannot be written.",
        "Device type, error register, identity and the entries of the error history are read-only in every device \
         (CiA 301, 7.5.2).";
    "cia402::missing-object" Warning Check(cia301::missing_profile_object),
        "The objects that the device profile demands are there.",
        "A drive of CiA 402 has a controlword (6040h) and a statusword (6041h).";
    "cia301::device-type" Warning Check(cia301::device_type),
        "The device type names the profile that the objects are of.",
        "The low half of 1000h is the number of the profile (CiA 301, 7.5.2.1), by which tools choose how to treat the \
         device. A controlword and a statusword without 402, or a number that is a profile with its bytes exchanged, \
         is a mistake of the file or of the firmware; so are the bits 16 to 19 of an I/O device (CiA 401) that deny inputs or \
         outputs it has.";
    "cia301::no-error-control" Warning Check(cia301::no_error_control),
        "The device has heartbeat or node guarding.",
        "CiA 301 demands one of them: the heartbeat producer time 1017h, or guard time 100Ch and life time factor \
         100Dh. Without it the loss of the device goes unnoticed.";
    "cia301::half-guarding" Warning Check(cia301::half_guarding),
        "Guard time and life time factor come together.",
        "The life time is the product of 100Ch and 100Dh (CiA 301, 7.5.2.11); one without the other means nothing.";
    "cia301::two-error-controls" Warning Check(cia301::two_error_controls),
        "Heartbeat and node guarding are not both active by default.",
        "A device uses one error control at a time (CiA 301); with a heartbeat time other than 0 it does not answer \
         guarding.";
    "cia301::identity" Warning Check(cia301::identity),
        "The identity object and DeviceInfo name the same device.",
        "Tools find the data sheet of a device by the numbers in 1018h, and look for them in `[DeviceInfo]`.";
    "cia301::emcy-cob-id" Note Check(cia301::emcy_cob_id),
        "The default COB-ID of EMCY is 80h plus the node-ID.",
        "CiA 301 (7.5.2.17) fixes the default of 1014h; managers that do not read 1014h listen there. A number without \
         `$NODEID` is that of one node, and a device that is made of the data sheet has it on every node.";
    "cia301::sync-cob-id" Warning Check(cia301::sync_cob_id),
        "The COB-ID of SYNC is not one that CiA 301 keeps for something else.",
        "The default of 1005h is 80h (CiA 301, 7.5.2.5). Another one must not be among those that are restricted.";
    "cia301::sdo-cob-id" Warning Check(cia301::sdo_cob_id),
        "The default SDO has the COB-IDs 600h and 580h plus the node-ID.",
        "They are fixed (CiA 301, 7.5.2.33): a manager must reach every device before it knows anything of it.";
    "cia301::sdo-client" Note Check(cia301::sdo_client),
        "The SDO client parameters name a server.",
        "1280h to 12FFh without sub-index 3 leave open which device the client talks to (CiA 301, 7.5.2.34).";
    "cia301::heartbeat-consumer" Warning Check(cia301::heartbeat_consumer),
        "A heartbeat consumer time names a node-ID up to 127.",
        "Bits 16 to 23 of 1016h are the node-ID, bits 0 to 15 the time in ms; the rest is 0 (CiA 301, 7.5.2.19).";
    "eds::more-findings" Note Last,
        "No rule finds more than a thousand things in a file.",
        "The findings of a rule beyond the thousandth are counted, but not kept, so that a broken file cannot \
         exhaust memory.";
}
