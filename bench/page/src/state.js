// The state of the page: the bench's view, one signal per field, and the user's choices.
import { batch, computed, signal } from '@preact/signals'
import { EMPTY } from './words.js'

/**
 * @import { Signal } from '@preact/signals'
 * @import { Connection } from './types'
 * @import { View } from './wire'
 */

/** @type {{ [Field in keyof View]: Signal<View[Field]> }} */
// @ts-ignore: `Object.fromEntries` loses the type of each field
export const view = Object.fromEntries(Object.entries(EMPTY).map(([field, value]) => [field, signal(value)]))

/** @type {Signal<Connection>} */
export const connection = signal('connecting')
/** The client number of this page, and the version of the bench. */
export const client = signal(null)
export const version = signal('')

export const hasControl = computed(() => connection.value === 'open' && view.control.value.holder === client.value)
/** Why nothing on the bus can be changed from here, as a key of the texts; null if it can. */
export const whyNot = computed(() => {
  if (connection.value !== 'open') return 'control.lost'
  if (!view.bus.value.is_writable) return 'control.read-only'
  return hasControl.value ? null : 'control.first'
})

/**
 * Updates the fields of a view that have changed. Ignores fields that the page does not know.
 * @param {Partial<View>} changes
 */
export function applyView(changes) {
  batch(() => {
    for (const [field, value] of Object.entries(changes)) if (field in view) view[field].value = value
  })
}

/**
 * Updates how the last stop went from what the drives have confirmed. A stop that was refused is repeated until every
 * drive stands. `last` is `stop` of bench.js.
 */
export function stopSince(last, drives) {
  if (last?.state !== 'refused') return last
  if (drives.some((drive) => drive.unconfirmed)) return last.isSent ? last : { ...last, isSent: true }
  return last.isSent ? { ...last, state: 'confirmed' } : last
}

export const TABS = ['nodes', 'objects', 'pdos', 'trace', 'plots', 'drives', 'bus', 'devices']

/** Splits `#objects/5` into the tab and the chosen node. */
export function parsePlace(hash) {
  const [tab, node] = hash.replace(/^#/, '').split('/')
  const id = Number(node)
  return { tab: TABS.includes(tab) ? tab : 'nodes', node: Number.isInteger(id) && id >= 1 && id <= 127 ? id : null }
}

const place = parsePlace(globalThis.location?.hash ?? '')
export const tab = signal(place.tab)
export const chosenNode = signal(place.node)

/** The chosen node, else the first one. */
export const node = computed(() => {
  const nodes = view.nodes.value
  return nodes.find((each) => each.id === chosenNode.value) ?? nodes[0] ?? null
})
export const nodeId = computed(() => node.value?.id ?? null)

export function goTo(nextTab, nextNode = chosenNode.value) {
  batch(() => {
    tab.value = nextTab
    chosenNode.value = nextNode
  })
  history.replaceState(null, '', nextNode === null ? `#${nextTab}` : `#${nextTab}/${nextNode}`)
}

/** The number of the row that the trace has to show; null once it does. */
export const wantedRow = signal(null)

export function goToRow(number) {
  wantedRow.value = number
  goTo('trace')
}
