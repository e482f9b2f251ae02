// The searchable tree of a data sheet.

/** Also accepts `0x6081` and `6081h` for the `6081` of an address. */
const HEX = /^(?:0x)?([0-9a-f]{2,6})h?$/

/** Whether address, names, group or unit of an entry contain all words of a query. */
export function matches(entry, query) {
  const text = `${entry.address} ${entry.object} ${entry.name} ${entry.group} ${entry.unit ?? ''}`.toLowerCase()
  return query
    .toLowerCase()
    .split(/\s+/)
    .every((word) => text.includes(word) || text.includes(HEX.exec(word)?.[1] ?? word))
}

/**
 * The rows of the tree: groups, objects, and the entries of objects with several. `closed` has the keys of folded rows;
 * a query unfolds all.
 */
export function treeRows(entries, query, closed) {
  const wanted = query.trim() === '' ? entries : entries.filter((entry) => matches(entry, query.trim()))
  const groups = new Map()
  for (const entry of wanted) {
    const index = entry.address.slice(0, 4)
    const group = groups.get(entry.group) ?? groups.set(entry.group, new Map()).get(entry.group)
    const object = group.get(index) ?? group.set(index, []).get(index)
    object.push(entry)
  }
  const isOpen = (key) => query.trim() !== '' || !closed.has(key)
  const rows = []
  for (const [name, objects] of groups) {
    const count = [...objects.values()].reduce((sum, object) => sum + object.length, 0)
    rows.push({ kind: 'group', key: name, level: 1, name, count, isOpen: isOpen(name) })
    if (!isOpen(name)) continue
    for (const [index, members] of objects) {
      if (members.length === 1 && members[0].address.endsWith(':00')) {
        rows.push({ kind: 'entry', key: members[0].address, level: 2, entry: members[0] })
        continue
      }
      const object = { kind: 'object', key: index, level: 2, name: members[0].object, count: members.length }
      rows.push({ ...object, isOpen: isOpen(index) })
      if (isOpen(index)) rows.push(...members.map((entry) => ({ kind: 'entry', key: entry.address, level: 3, entry })))
    }
  }
  return rows
}

/** All entries with the values that were read, by address. */
export function withValues(entries, values) {
  const known = new Map(values.map((value) => [value.address, value]))
  return entries.map((entry) => (known.has(entry.address) ? { ...entry, value: known.get(entry.address) } : entry))
}
