//! Reads data sheets as rows.

/// A data sheet whose device section is `info`. A row has an address, a data type and an access, then the default and
/// the highest value if there are any, and other keys: `607D:01 4 rww 0 PDOMapping=1`. The count of an array needs no
/// row.
pub(crate) fn eds(info: &str, rows: impl Iterator<Item = String>) -> String {
    let mut rows: Vec<String> = rows.filter(|row| !row.trim().is_empty()).collect();
    rows.sort_unstable();
    let (mut eds, mut indices) = (format!("[DeviceInfo]\n{info}"), Vec::new());
    for row in &rows {
        let words: Vec<&str> = row.split_whitespace().collect();
        let (index, sub) = words[0].split_once(':').map_or((words[0], None), |(index, sub)| (index, Some(sub)));
        if !indices.contains(&index) {
            indices.push(index);
            let subs = rows.iter().filter_map(|row| row.strip_prefix(index)?.strip_prefix(':'));
            let count = subs.filter(|sub| !sub.starts_with("00")).count();
            if sub.is_some() {
                eds += &format!("[{index}]\nParameterName=Object {index}\nObjectType=9\nSubNumber={}\n", count + 1);
            }
            if sub.is_some_and(|sub| sub != "00") {
                eds +=
                    &format!("[{index}sub0]\nParameterName=Count\nDataType=5\nAccessType=ro\nDefaultValue={count}\n");
            }
        }
        let section = sub.map_or(index.to_owned(), |sub| format!("{index}sub{:X}", sub.parse::<u8>().unwrap()));
        eds += &format!("[{section}]\nParameterName=Entry {section}\nDataType={}\nAccessType={}\n", words[1], words[2]);
        let (keys, numbers): (Vec<&str>, Vec<&str>) = words[3..].iter().partition(|word| word.contains('='));
        let named = ["DefaultValue", "HighLimit"].iter().zip(numbers).map(|(key, number)| format!("{key}={number}"));
        named.chain(keys.into_iter().map(str::to_owned)).for_each(|line| eds += &(line + "\n"));
    }
    eds += &format!("[OptionalObjects]\nSupportedObjects={}\n", indices.len());
    indices.iter().zip(1..).for_each(|(index, number)| eds += &format!("{number}=0x{index}\n"));
    eds
}
