// The filter of the trace, in the notation of `lexican monitor`'s options.

import { NO_FILTER } from './words.js'

export const SERVICES = ['nmt', 'sync', 'time', 'emcy', 'heartbeat', 'sdo', 'tpdo', 'rpdo', 'lss']

/** A list with a word added, or removed if it was there. */
export function toggled(list, word) {
  const words = list
    .split(',')
    .map((each) => each.trim())
    .filter(Boolean)
  const next = words.includes(word) ? words.filter((each) => each !== word) : [...words, word]
  return next.join(',')
}

export const has = (list, word) => list.split(',').some((each) => each.trim() === word)

export const isFiltering = (filter) =>
  Object.entries(NO_FILTER).some(([key, none]) => key !== 'transfers' && filter[key] !== none)

/** The filter as options of `lexican monitor`, for a terminal. */
export function asOptions(filter) {
  const words = []
  for (const key of ['nodes', 'services', 'without', 'object', 'ids', 'text'])
    if (filter[key]) words.push(`${key}=${filter[key]}`)
  if (filter.alarming) words.push('alarming')
  return words.join('  ')
}
