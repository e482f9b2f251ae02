// Types of the page itself. The messages between the bench and the page are in wire.d.ts.
import type { Content, Request } from './wire'

/** `refused` when the bench does not know the token. */
export type Connection = 'connecting' | 'open' | 'lost' | 'ended' | 'refused'

type Part<K extends string> = Extract<Content, Record<K, unknown>>[K & keyof Extract<Content, Record<K, unknown>>]

/** What the answers of requests contain that are not just done. */
type Brings = {
  objects: Part<'objects'>
  read: Part<'values'>
  seen: Part<'values'>
  compare: Part<'differences'>
  backup: Part<'file'>
  pdos: Part<'pdos'>
  'map-pdo': Part<'objections'>
  trace: Part<'frames'>
  export: Part<'file'>
  curves: Part<'curves'>
  number: Part<'number'>
  'export-plot': Part<'file'>
  record: Part<'file'>
  'play-sequence': Part<'file'>
}

/** The content of the answer to a request. */
export type Brought<R extends Request> = R['do'] extends keyof Brings ? Brings[R['do']] : true
